#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a file that begins with `head` is PNG.
[[nodiscard]] bool looks_like_png(std::span<const std::byte> head);

/// Opens one channel of a PNG file: the stored numbers, 8 or 16 bits, with no gamma, colour management or alpha
/// applied. Gray of 1, 2 and 4 bits comes as uint8 with the stored value (0...15, not stretched to 0...255). The gray
/// value that a tRNS chunk calls transparent is void; without options.channel so is gray whose opacity is 0. What
/// NAME.png.json says (raster_description.h) is taken over, but for packed elevations.
///
/// options.channel is Y or A (gray), R, G, B or A (colour), or 0...3; without it the first one, with a warning for a
/// colour picture, whose channels may be the bytes of packed elevations; or terrarium, mapbox or rgba-float for those
/// (packed_elevations.h).
/// Rows are decoded in order; going back further than the few hundred rows that are kept starts again from the first.
/// An interlaced picture is decoded whole, up to kMaxInterlacedBytes.
/// Throws Error naming the path: kUnsupported (palette, interlaced and too large), kCorrupt (with the row; the .json),
/// kIo, kInvalidArgument (no such channel, with those there are).
[[nodiscard]] std::unique_ptr<HeightSource> open_png(const std::string& path, const OpenOptions& options);

/// The most bytes that the pixels of an interlaced picture may take: 1 GiB.
inline constexpr std::uint64_t kMaxInterlacedBytes = std::uint64_t{1} << 30U;

}  // namespace isohf
