// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "isohf/archive.h"
#include "isohf/job.h"
#include "isohf/picture.h"
#include "isohf/surface.h"

/// A shaded picture of an archive's surface: hill shading, cast shadows, textures.

namespace isohf {

/// Where the sun stands: shadows fall along the lattice's rows.
enum class SunSide { kWest, kEast };

/// Colours of the ground by elevation.
enum class ShadePalette { kElevation, kGray };

/// What a picture of an archive's surface shows. It covers the part of the world that the source covered.
struct ShadeOptions {
  std::optional<GridSize> size;  ///< pixels, >= 1; nullopt: shade_size()
  SunSide sun = SunSide::kWest;
  double sun_elevation_deg = 15.0;  ///< above 0, below 90
  bool shadows = true;              ///< that land casts on land beyond it
  bool hillshade = false;           ///< shade slopes by how they face the sun
  double exaggeration = 1.0;        ///< of heights, > 0
  /// The sun's apparent size at the caster's distance, elevation units, > 0 (paper Eq. 16); nullopt: 2, or 0.5 % of the
  /// elevation range where that is less.
  std::optional<double> softness;
  ShadePalette palette = ShadePalette::kElevation;
  bool texture = false;  ///< the archive's textures where it has them, over the palette's colours
  double elevation_units_per_world_unit = 1.0;  ///< feet for one metre, say; > 0
};

/// How a picture was made.
struct ShadeReport {
  GridSize size;
  int plane = 0;  ///< coarse plane that was drawn; 0: the tiles themselves
  bool used_seeds =
      false;  ///< shadow seeds of the archive, which a coarse plane has none of; else shadows were carried along each row of tiles
};

/// Bytes of a pixel: red, green, blue, alpha, sRGB; 0 everywhere without elevation.
inline constexpr std::int64_t kShadeChannels = 4;

/// A pixel for each lattice step, at most 2048 a side; or so many along the longer side, and as many as keep the shape
/// along the other.
[[nodiscard]] GridSize shade_size(const ArchiveReader& archive, std::optional<std::int64_t> longest = {});

/// Whole rows of the picture, from North to South: [k * width * kShadeChannels].
using TakeShadedRows = std::function<void(std::span<const std::uint8_t> rows)>;

/// Renders a picture and hands over whole rows. The pixels do not depend on the number of threads; every pixel is the
/// mean of up to 4 x 4 points. Where a coarse plane has two vertices or more in a pixel, either way, the coarsest such one
/// is drawn and nothing finer read, unless textures are. Memory: a few dozen tiles, and the picture's rows across one row of tiles, at most 64 MB
/// or one row. Throws Error{kInvalidArgument} for options out of range, and for textures of an archive that has none;
/// as the reader does; kCancelled.
ShadeReport shade_rows(const ArchiveReader& archive, const ShadeOptions& options, const TakeShadedRows& take,
                       const Job& job = {});

/// The whole picture at once.
[[nodiscard]] Picture shade(const ArchiveReader& archive, const ShadeOptions& options, const Job& job = {});

}  // namespace isohf
