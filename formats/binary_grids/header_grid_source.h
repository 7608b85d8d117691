#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a file that begins with `head` is the .hdr of an EHdr grid, or an ENVI one, by its first word.
[[nodiscard]] bool looks_like_grid_header(std::span<const std::byte> head);

/// Opens plain samples with a text header beside them: GridFloat (.flt and .hdr) and ESRI's EHdr (.bil, .bip or .bsq
/// and .hdr) of one band, and GTOPO30 (.dem and .hdr), which is EHdr. `path` is either file. Signed and unsigned
/// integers of 8, 16 and 32 bits, floats of 32 and 64, both byte orders, padded rows, skipped bytes. xllcorner and
/// yllcorner name a corner, ulxmap and ulymap and the centres a cell's centre; cells are areas. A .prj beside them is
/// read, and a world file (.blw, .bqw, .flw) where the header gives no place. Where the header leaves the byte order or
/// the sign open, little-endian and signed samples are read, with a warning. Throws Error: kIo (one of the two files is
/// not there), kCorrupt (a length that contradicts the header; a bad header), kUnsupported (several bands, other sample
/// types, an ENVI header), kInvalidArgument (a channel).
[[nodiscard]] std::unique_ptr<HeightSource> open_header_grid(const std::string& path, const OpenOptions& options);

}  // namespace isohf
