#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>

#include "isohf/archive.h"
#include "isohf/surface/shade/shadow.h"
#include "shade/shade_light.h"

namespace isohf::cli {

/// What a picture of an archive's surface shows.
struct ShadeRequest {
  std::int64_t width = 0;  ///< pixels, >= 1; the picture covers the part of the world that the source covered
  std::int64_t height = 0;
  LightTravel travel = LightTravel::kEastward;
  double sun_elevation_deg = 15.0;  ///< above 0, below 90
  bool shadows = true;
  bool hillshade = false;
  double exaggeration = 1.0;  ///< of heights, > 0
  double softness = 2.0;      ///< the sun's apparent size, elevation units, > 0 (Eq. 16)
  PaletteName palette = PaletteName::kElevation;
  bool texture = false;  ///< the archive's textures where it has them, over the palette's colours
  double elevation_units_per_world_unit = 1.0;
};

/// How a picture was made.
struct ShadeReport {
  bool used_seeds = false;  ///< shadow seeds of the archive; else shadows were carried along each row of tiles
};

/// Bytes of a pixel: red, green, blue, alpha, sRGB; 0 everywhere without elevation.
inline constexpr std::int64_t kShadeChannels = 4;

/// Renders from North to South and hands over whole rows. The pixels do not depend on the number of threads; every
/// pixel is the mean of up to 4 x 4 places. Memory: a few dozen tiles, and the picture's rows across one row of tiles,
/// at most 64 MB or one row. Works on the caller's oneTBB arena. Throws as the reader does; Error{kCancelled}.
ShadeReport render_shade(const ArchiveReader& archive, const ShadeRequest& request,
                         const std::function<void(std::span<const std::uint8_t>)>& write_rows,
                         const std::function<void(std::int64_t done, std::int64_t total)>& progress,
                         const std::atomic<bool>& cancel);

}  // namespace isohf::cli
