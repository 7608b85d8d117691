#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Whether a file that begins with `head` is a USGS DEM, by the codes at bytes 144 to 168 of its type A record.
[[nodiscard]] bool looks_like_usgs_dem(std::span<const std::byte> head);

/// Opens a USGS DEM (National Mapping Division, Standards for Digital Elevation Models, part 2: type A and B records of
/// 1024 bytes, with or without line ends, blanks at their end perhaps left out): profiles from West to East, each from
/// South to North, in metres, feet or seconds of arc. Profiles of a UTM quadrangle begin and end where its sides run;
/// what lies beyond is void, as is -32767. Samples are posts, int16 or, where the header's range needs it, int32; the
/// vertical resolution is their scale. Memory: one entry and one profile at a time for each column.
/// Throws Error naming file and profile: kIo, kCorrupt, kUnsupported (radians, rotated or irregular grids),
/// kInvalidArgument.
[[nodiscard]] std::unique_ptr<HeightSource> open_usgs_dem(const std::string& path, const OpenOptions& options);

}  // namespace isohf
