// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "isohf/archive.h"
#include "isohf/job.h"
#include "isohf/picture.h"
#include "isohf/raster.h"
#include "isohf/surface.h"

/// Pictures of an archive's surface: shaded relief with cast shadows and textures, hillshades, and shadows alone.

namespace isohf {

/// What is drawn. All but the first have one channel.
enum class ShadeKind {
  kPicture,  ///< colours, sun, sky and cast shadows
  /// Horn's formula on the elevations that the surface has in the middle of the picture's pixels (RestoreMethod
  /// kBarycentric), as `gdaldem hillshade -compute_edges`: 1...255, 0 where there is no elevation.
  kHillshade,
  kShadowMask,  ///< share of the sun that is seen, 1...255; 0 where there is no elevation
};

/// Colours of the ground by elevation: meadows to snow, and the sea below 0 on Earth; greys; the dust of Mars.
enum class ShadePalette { kElevation, kGray, kMars };

/// The colour at one elevation; sRGB.
struct ColourStop {
  double elevation = 0.0;
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
};

/// Whether air reddens the sun's light and scatters some: on Earth, Venus, Mars and Titan, and where the body is not known.
[[nodiscard]] bool has_air(const Metadata& metadata);

/// The palette's colours over the archive's range, by rising elevation; at one elevation there may be two. nullopt: the
/// palette of its body, grey where that is neither Earth nor Mars.
[[nodiscard]] std::vector<ColourStop> shade_colours(const Metadata& metadata, std::optional<ShadePalette> palette = {});

/// A day of the Gregorian calendar and a time of day, 0 to 24: mean solar time, which is near to what clocks say, and
/// takes no account of time zones. On Mars hours are 24 of its own day, the date is the Earth's.
struct SolarTime {
  int year = 2000;
  int month = 6;
  int day = 21;
  double hours = 12.0;
};

/// Where the sun stands: degrees clockwise from the North of the archive's map, and above the horizon, below it < 0. Without
/// the air's refraction.
struct SunPlace {
  double azimuth_deg;
  double elevation_deg;
};

/// The sun's way over the middle of an archive's ground.
class DaySky {
 public:
  /// Throws Error{kInvalidArgument} where the body is neither Earth nor Mars or the archive has no place in degrees. Ask
  /// understand_source() first for those whose source lies on a map of its own.
  explicit DaySky(const ArchiveReader& archive);
  [[nodiscard]] SunPlace sun(const SolarTime& time) const;
  [[nodiscard]] GeoPoint place() const { return place_; }

 private:
  bool is_mars_ = false;
  GeoPoint place_{};
  double north_deg_ = 0.0;  ///< clockwise from the map's to the body's
};

/// What a picture of an archive's surface shows. It covers the part of the world that the source covered.
struct ShadeOptions {
  ShadeKind kind = ShadeKind::kPicture;
  std::optional<GridSize> size;     ///< pixels, >= 1; nullopt: shade_size()
  double sun_azimuth_deg = 270.0;   ///< clockwise from the North of the archive's map
  double sun_elevation_deg = 15.0;  ///< above 0; below 90 where shadows are cast, else 90 at most
  bool shadows = true;              ///< of kPicture: that land casts on land beyond it
  double exaggeration = 1.0;        ///< of heights, > 0
  /// A penumbra of one size at all distances, elevation units, > 0 (k of paper Eq. 16); nullopt: that of the sun's disc as
  /// it is seen from the archive's body, which grows with the caster's distance.
  std::optional<double> softness;
  std::optional<ShadePalette> palette;  ///< nullopt: its body's
  bool texture = false;                 ///< the archive's textures where it has them, over the palette's colours
  /// Samples are floats: linear light with premultiplied alpha, or shares from 0 to 1, NaN where there is no elevation.
  bool floats = false;
};

/// How a picture was made.
struct ShadeReport {
  GridSize size;
  int plane = 0;  ///< coarse plane that was drawn; 0: the tiles themselves
};

/// Samples of a pixel.
struct ShadeSamples {
  SampleType type = SampleType::kUint8;
  int channels = 4;  ///< red, green, blue, alpha (bytes: sRGB, straight alpha, 0 everywhere without elevation), or one
  std::optional<double> void_value;  ///< of one channel
};
[[nodiscard]] ShadeSamples shade_samples(const ShadeOptions& options);

/// A pixel for each lattice step, at most 2048 a side; or so many along the longer side, and as many as keep the shape
/// along the other.
[[nodiscard]] GridSize shade_size(const ArchiveReader& archive, std::optional<std::int64_t> longest = {});

/// Whole rows of the picture, from North to South, in shade_samples().
using TakeShadedRows = std::function<void(std::span<const std::byte> rows)>;

/// Renders a picture and hands over whole rows. The pixels do not depend on the number of threads. But for hillshades, a
/// pixel's height and its share of the sun are means of up to 4 x 4 points; slopes are Horn's, of the pixels around. Where a coarse plane
/// has two vertices or more in a pixel, either way, the coarsest such one is drawn and nothing finer read, unless
/// textures are. Memory: a row of tiles twice, and 64 MB of the picture's rows, or three rows. A sun in the South reads
/// the tiles once more, and keeps 64 MB of shadows; or what job.memory_bytes allows. Ground beyond the source casts none.
/// Throws Error{kInvalidArgument} for options out of range, and for textures of an archive that has none; as the reader
/// does; kCancelled.
ShadeReport shade_rows(const ArchiveReader& archive, const ShadeOptions& options, const TakeShadedRows& take,
                       const Job& job = {});

/// The whole picture at once, of bytes: not with `floats`.
[[nodiscard]] Picture shade(const ArchiveReader& archive, const ShadeOptions& options, const Job& job = {});

}  // namespace isohf
