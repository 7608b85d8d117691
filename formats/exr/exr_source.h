#pragma once

#include <memory>
#include <string>

#include "formats/exr/exr_header.h"
#include "isohf/raster.h"

namespace isohf {

/// Opens one channel of an OpenEXR file: scan lines or tiles (their largest level), any compression, any line order,
/// half, float or uint samples as stored. The raster is the data window, whatever the display window says.
///
/// options.part is the name or number of a part of a file of several; without it all count.
/// options.channel is a channel's name, "part.channel" in a file of several parts, or a number in the order in which
/// an error message lists them. Without it the first flat part is read: its channel Y, Z, height, Height, elevation,
/// depth or R, else one whose layer name ends so, else its first.
/// Memory: one row of chunks of the one channel, and what the OpenEXR library keeps to decode a few chunks.
/// Throws Error naming the path: kUnsupported (deep data, a subsampled channel, chunks above kMaxExrChunkBytes),
/// kCorrupt, kIo, kInvalidArgument (no such channel, with those there are).
[[nodiscard]] std::unique_ptr<HeightSource> open_exr(const std::string& path, const OpenOptions& options);

}  // namespace isohf
