#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a file that starts with `head` (4 bytes are enough) is a TIFF or BigTIFF file of either byte order.
[[nodiscard]] bool looks_like_tiff(std::span<const std::byte> head);

/// Opens the first full-size image of a TIFF, GeoTIFF, BigTIFF or COG file (TIFF 6.0; OGC GeoTIFF 1.1, 19-008r4):
/// 8, 16 and 32 bit integers, 16, 32 and 64 bit floats, strips or tiles, any compression that libtiff was built with,
/// interleaved or separate samples, of which options.channel picks one ("0", "1", ... or "R", "G", "B", "A", "Y").
///
/// Rows are delivered from North to South: a raster stored from South to North (by its transformation, or by
/// orientation bottom-left where it has no georeference) is turned. Without GeoTIFF tags a world file beside it places
/// the raster. Void is what GDAL_NODATA says; in a float raster without it, whatever lies beyond 1e30, such as -3.4e38.
/// Where no channel is asked for, samples that are transparent are void as well: by a mask in the file, one that lies
/// beside it (.msk), or the opacity of a grey image of two channels (masked_source.h).
/// Blocks that a sparse file leaves out read as the void value, else as 0, with a warning.
///
/// Full-width windows from North to South decode every block once, on all threads of the caller's arena; memory is
/// bounded by two rows of blocks or 16 MiB, whichever is more.
///
/// Throws Error: kIo; kCorrupt (truncated, contradictory or absurdly large); kUnsupported (other sample types, colour
/// palettes, rotation, unknown compression); kInvalidArgument (no such channel; options out of range).
[[nodiscard]] std::unique_ptr<HeightSource> open_tiff(const std::string& path, const OpenOptions& options);

}  // namespace isohf
