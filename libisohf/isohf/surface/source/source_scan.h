#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "isohf/raster.h"
#include "isohf/surface/source/sample_types.h"

namespace isohf {

/// Smallest and largest elevation of a source, in its vertical units.
struct ElevationRange {
  double min = 0.0;
  double max = 0.0;
};

/// What the first pass over a source finds.
struct SourceScan {
  ElevationRange range;    ///< meaningless where valid is 0
  std::int64_t valid = 0;  ///< samples with an elevation
  std::int64_t voids = 0;
};

/// Accumulates range and counts over raw samples of the source's type, exactly, z_scale and z_offset applied.
void scan_samples(const SourceInfo& info, std::span<const std::byte> raw, SourceScan& scan);

/// The sum of all valid raw samples, z_scale and z_offset left aside. The order of summation is fixed.
[[nodiscard]] double sum_of_samples(const SourceInfo& info, std::span<const std::byte> raw);

/// The datum that heights of this source are taken from (heights_from_samples): the middle of the range, rounded, for
/// samples of more than 24 bits or scaled ones, so that single precision holds them; 0 for all others.
[[nodiscard]] double choose_datum(const SourceInfo& info, const ElevationRange& range);

}  // namespace isohf
