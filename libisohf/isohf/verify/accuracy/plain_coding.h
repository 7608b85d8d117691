#pragma once

#include <cstdint>
#include <span>

#include "isohf/archive/codec/tile_codes.h"

namespace isohf {

/// A yardstick that knows no lattice: bytes of the samples as a compressed TIFF stores a tile of them. Every row by the
/// differences of horizontal neighbours (predictor 2; for floats predictor 3, byte planes), then raw Deflate at
/// libdeflate's level 6. Headers and tables of a file are not counted.
///
/// samples  rows one after the other    widths  samples of each row, in turn: rows of a lattice are not all of one
/// width
[[nodiscard]] std::uint64_t plainly_coded_bytes(const TileCodes& samples, std::span<const std::int64_t> widths);

}  // namespace isohf
