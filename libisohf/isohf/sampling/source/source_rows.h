#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/base/file.h"
#include "isohf/job.h"
#include "isohf/raster.h"
#include "isohf/sampling/resample/row_sampler.h"
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

/// Memory that others gave back, on whatever thread dropped it last: fresh memory would be cleared page by page.
template <typename T>
class Recycled {
 public:
  /// One that was dropped, or what make() makes (std::unique_ptr<T>).
  template <typename Make>
  [[nodiscard]] std::shared_ptr<T> take(const Make& make) const {
    std::unique_ptr<T> value;
    if (const std::lock_guard lock(idle_->mutex); !idle_->values.empty()) {
      value = std::move(idle_->values.back());
      idle_->values.pop_back();
    }
    if (!value) value = make();
    return {value.release(), [idle = idle_](T* dropped) {
              const std::lock_guard lock(idle->mutex);
              idle->values.emplace_back(dropped);
            }};
  }

 private:
  struct Idle {
    std::mutex mutex;
    std::vector<std::unique_ptr<T>> values;
  };
  std::shared_ptr<Idle> idle_ = std::make_shared<Idle>();
};

/// Raw samples of consecutive rows of a source, unchanging. Any number of threads at once.
class RawRows {
 public:
  RawRows() = default;
  RawRows(const RawRows&) = delete;
  RawRows& operator=(const RawRows&) = delete;
  virtual ~RawRows() = default;
  /// `count` samples of `row` from `column` on: where they are kept, or in `buffer`, which is made as large as need be.
  [[nodiscard]] virtual std::span<const std::byte> part(std::int64_t row, std::int64_t column, std::int64_t count,
                                                        std::vector<std::byte>& buffer) const = 0;
};

/// Reads a source from North to South, each block once, and keeps the rows that are asked for: in memory, or in a file
/// without a name where even those of one row of tiles are too many for it. One thread.
class SourceRows {
 public:
  /// Rows are kept in memory, for as long as a RawRows that holds them.
  SourceRows(HeightSource& source, const ReadStep& step);
  /// Rows are kept in a scratch file in `folder`: always the last `kept_rows` that were read.
  SourceRows(HeightSource& source, const ReadStep& step, const std::string& folder, std::int64_t kept_rows);

  /// Rows that a scratch file needs room for, where up to `rows` from the first to the last are in use.
  [[nodiscard]] static std::int64_t kept_rows_for(const ReadStep& step, std::int64_t rows) {
    return rows + 2 * step.rows;
  }

  /// The rows of `range`; neither end goes back from one call to the next.
  [[nodiscard]] std::shared_ptr<const RawRows> rows(const RowRange& range);
  [[nodiscard]] const SourceInfo& info() const { return source_.info(); }

 private:
  struct Slab;
  class SlabRows;
  class ScratchRows;

  void read_slab();
  void read_to_scratch();

  HeightSource& source_;
  ReadStep step_;
  Recycled<Slab> recycled_;
  std::deque<std::shared_ptr<const Slab>> slabs_;
  std::shared_ptr<File> scratch_;
  std::int64_t kept_rows_ = 0;
  std::vector<std::byte> raw_;
  std::int64_t next_ = 0;  ///< the row that is read next
};

}  // namespace isohf
