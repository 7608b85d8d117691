#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "paging/tile_source.h"

namespace isohf::view {

/// A sun over the heights as they are drawn: what shadows are computed for.
struct CastingSun {
  double azimuth_deg = 270.0;   ///< clockwise from North, any
  double elevation_deg = 15.0;  ///< above 0, below 90
  double exaggeration = 1.0;    ///< of heights, > 0
  friend bool operator==(const CastingSun&, const CastingSun&) = default;
};

/// Depths in a shadow are counted in such parts of a gain.
inline constexpr float kDepthSteps = 32767.0F;

/// What a tile is shaded by.
struct TileShadow {
  TileIndex tile{};
  /// [C x R] at visible vertices: the part of the sun that is hidden, in kDepthSteps of `gain`; beyond 0 and 1 how near
  /// a shadow's border is.
  std::vector<std::int16_t> depths;
  float gain = 0.0F;
};

/// Bounds on what is read for shadows.
struct CastingLimits {
  std::int64_t tiles = 1024;
  std::int64_t columns = 1024;  ///< that are held at once, a row of tiles at a time
  bool uses_seeds = true;
};

/// Shadows of tiles of one plane, swept as `isohf shade` sweeps them (decision 48). Besides the tiles asked for, those
/// are read that may cast shadows on them: as far towards the sun as what is known of the tiles' heights says, within
/// the limits; of what lies farther nothing is cast. What the source does not cover casts none either. Where light runs
/// along the rows and the archive's seeds serve it, none but the tiles themselves are read: each is swept by itself,
/// from the state in which light enters it.
/// cancelled  ends it early, with what it has
/// unread     what the first tile said that could not be read; such tiles count as void
[[nodiscard]] std::vector<TileShadow> cast_shadows(const TileSource& source, const CastingSun& sun,
                                                   const std::vector<TileIndex>& tiles, const CastingLimits& limits,
                                                   const std::atomic<bool>& cancelled, std::string& unread);

/// Whether they come from the archive's seeds.
[[nodiscard]] bool uses_seeds(const TileSource& source, const CastingSun& sun);

/// The tiles that are swept for those of a range.
[[nodiscard]] TileRange casting_range(const TileSource& source, const CastingSun& sun, const TileRange& shaded,
                                      const CastingLimits& limits);

}  // namespace isohf::view
