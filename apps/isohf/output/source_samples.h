#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common.h"
#include "formats/write/raster_sink.h"
#include "isohf/archive.h"
#include "isohf/restore/sample_store.h"

namespace isohf::cli {

/// Where an archive's own source samples go.
struct SourceSamplesTarget {
  std::string output;
  std::optional<SampleType> type;  ///< nullopt: the source's, as far as the format holds it
  bool overwrite = false;
  ScratchFolder scratch;
};

struct WrittenSamples {
  SampleMapping mapping;
  std::vector<std::string> files;
};

/// Writes the samples that --lossless kept, bit for bit, or in another type if it holds every one of them exactly. Prints
/// warnings. Throws Error{kInvalidArgument} for a sample that the type does not hold, kCorrupt as SourceRowReader, kIo.
[[nodiscard]] WrittenSamples write_source_samples(const Common& common, const ArchiveReader& archive,
                                                  const SourceSamplesTarget& target, const Job& job);

}  // namespace isohf::cli
