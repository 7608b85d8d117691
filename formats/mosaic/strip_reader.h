#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <vector>

#include "isohf/base/sample.h"
#include "isohf/raster.h"

namespace isohf {

/// Strips of whole rows of members, or whole blocks of theirs, up to about this size...
inline constexpr std::int64_t kStripBytes = std::int64_t{16} << 20U;
/// ...and one row of blocks up to this size, so that no block is decoded twice.
inline constexpr std::int64_t kMostStripBytes = std::int64_t{256} << 20U;
/// Parts of members that are read side by side.
inline constexpr std::size_t kBatchBytes = std::size_t{8} << 20U;

/// Reads a raster that is composed of others by strips of rows, of which windows of fewer rows take theirs.
class StripReader {
 public:
  /// Fills all samples of a window.
  using Compose = std::function<void(const Window& window, std::span<std::byte> samples)>;

  StripReader(const SourceInfo& info, Compose compose) : info_(info), compose_(std::move(compose)) {}

  /// rows  of a strip, > 0; needed before anything is read
  void set_rows(std::int64_t rows) {
    rows_ = rows;
    number_ = -1;
  }

  void read(const Window& window, std::span<std::byte> samples) {
    // Passes read the same columns again and again; the first window of others is read as it is.
    const bool is_whole = columns_ == 0 && window.column == 0 && window.columns == info_.width;
    const bool follows = is_whole || (window.column == column_ && window.columns == columns_);
    if (!follows) number_ = -1;
    column_ = window.column;
    columns_ = window.columns;
    const std::size_t row_bytes = static_cast<std::size_t>(window.columns) * size_bytes(info_.sample_type);
    const std::int64_t end = window.row + window.rows;
    for (std::int64_t row = window.row; row < end;) {
      const std::int64_t strip = row / rows_;
      const std::int64_t top = strip * rows_;
      const std::int64_t bottom = std::min(top + rows_, info_.height);
      const std::int64_t rows = std::min(end, bottom) - row;
      const auto out = samples.subspan(static_cast<std::size_t>(row - window.row) * row_bytes,
                                       static_cast<std::size_t>(rows) * row_bytes);
      const bool in_one_go = !follows || (row == top && row + rows == bottom);
      if (strip != number_ && in_one_go) {
        compose_({window.column, row, window.columns, rows}, out);
      } else {
        if (strip != number_) {
          number_ = -1;
          samples_.resize(static_cast<std::size_t>(bottom - top) * row_bytes);
          compose_({column_, top, columns_, bottom - top}, samples_);
          number_ = strip;
        }
        std::memcpy(out.data(), samples_.data() + static_cast<std::size_t>(row - top) * row_bytes, out.size());
      }
      row += rows;
    }
  }

 private:
  const SourceInfo& info_;
  Compose compose_;
  std::int64_t rows_ = 0;
  std::vector<std::byte> samples_;  ///< of strip `number_`, in the columns below
  std::int64_t number_ = -1;
  std::int64_t column_ = 0;
  std::int64_t columns_ = 0;  ///< 0: nothing was read
};

}  // namespace isohf
