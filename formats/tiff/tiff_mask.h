#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// The transparency mask that is directory `directory` of a TIFF file: samples of one byte, 0 where the image is
/// transparent. Masks of 1 and of 8 bits are read, in strips or tiles of any compression.
/// rows_from_south  delivered last row first, as the image is whose mask it is
/// Throws Error: kIo; kCorrupt; kUnsupported (other bits).
[[nodiscard]] std::unique_ptr<HeightSource> open_tiff_mask(const std::string& path, std::uint32_t directory,
                                                           bool rows_from_south);

}  // namespace isohf
