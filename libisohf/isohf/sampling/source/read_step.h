#pragma once

#include <cstdint>
#include <vector>

#include "isohf/job.h"
#include "isohf/raster.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {

/// How a pass over a whole source reads it: `rows` at a time from the top, each time `columns` by `columns` from West
/// to East. Whole blocks, so that none is decoded twice, except of strips that are too large to hold.
struct ReadStep {
  std::int64_t rows = 1;
  std::int64_t columns = 1;

  /// About `bytes` in one read; more where a single block or row has more.
  [[nodiscard]] static ReadStep make(const SourceInfo& info, std::uint64_t bytes);
  /// Bytes of the largest read.
  [[nodiscard]] std::uint64_t most_bytes(const SourceInfo& info) const;
  /// The windows that make up the rows from `first` on, which is a multiple of `rows`.
  [[nodiscard]] std::vector<Window> windows(const SourceInfo& info, std::int64_t first) const;
};

/// The survey of all samples, with their mean. Stage "statistics". Throws Error{kCancelled}, and as reading does.
[[nodiscard]] SourceSurvey survey_whole(HeightSource& source, const Job& job);

}  // namespace isohf
