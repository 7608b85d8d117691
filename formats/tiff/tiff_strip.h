#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// How the rows of a strip are laid out before compression.
struct TiffStripLayout {
  SampleType sample_type = SampleType::kFloat32;
  std::size_t samples_per_row = 0;  ///< of all channels
  std::size_t channels = 1;         ///< interleaved
};

/// Predicts and deflates whole rows as TIFF asks for: predictor 2, differences of neighbouring samples, for integers;
/// predictor 3, differences of byte planes, for floats (TIFF 6.0 section 14; Adobe Photoshop TIFF technical note 3).
/// The compression is a zlib stream. `rows` is overwritten. The same rows always give the same bytes.
/// Throws Error{kOutOfMemory}.
[[nodiscard]] std::vector<std::byte> compress_tiff_strip(const TiffStripLayout& layout, std::span<std::byte> rows);

}  // namespace isohf
