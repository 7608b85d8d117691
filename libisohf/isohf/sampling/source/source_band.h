#pragma once

#include <cstdint>
#include <limits>

#include "isohf/base/view.h"

namespace isohf {

/// A run of source rows, or of columns, both ends included.
struct RowRange {
  std::int64_t first;
  std::int64_t last;

  /// What a union of ranges starts from.
  [[nodiscard]] static RowRange none() { return {std::numeric_limits<std::int64_t>::max(), 0}; }
};

/// Consecutive rows of the source, whole or in part, as heights relative to a datum, NaN where void: what a kernel's
/// taps read (coefficients, where the kernel has a prefilter).
struct SourceBand {
  View2D<const float> heights;
  std::int64_t first_row = 0;  ///< source row of heights.row(0)
  /// As large as heights, not 0 where the sample is void: coefficients go on into voids (Prefilter). No data where the
  /// NaN among heights are the voids.
  View2D<const char> voids = {};
  std::int64_t first_column = 0;  ///< source column of heights(0, ...)
};

}  // namespace isohf
