#pragma once

#include <span>

#include "isohf/lattice/crossings.h"
#include "isohf/light/shadow_sweep.h"
#include "isohf/restore/point_sampler.h"
#include "isohf/surface.h"

namespace isohf {

/// The shadow over single points: along the line from each to the sun, over every triangle that it passes (paper section
/// 3.13). What lies below the line's shadow so far by what the index says of its tile is not decoded.
class PointShadow {
 public:
  /// Throws Error{kInvalidArgument} where the sun, or the height `above` the surface, is out of range. The archive must
  /// outlive it.
  PointShadow(const ArchiveReader& archive, const Sun& sun, double above);

  /// elevations  of the surface at the points, NaN where there is none
  /// On the caller's oneTBB arena.
  void sample(std::span<const WorldPoint> points, std::span<const double> elevations, PointSampler& tiles,
              std::span<SunSample> samples) const;

 private:
  /// What stands towards the sun, from a point at some elevation.
  struct Horizon {
    double y;       ///< where the sun is looked for
    double shadow;  ///< S
    double rise;    ///< steepest from y to the ground, elevation units in one metre
  };
  void look(WorldPoint place, PointSampler& tiles, Horizon& seen) const;
  [[nodiscard]] bool can_hide(double highest, double distance, const Horizon& seen) const;
  [[nodiscard]] double share(const Horizon& seen) const;
  [[nodiscard]] double elevation_from_index(std::uint32_t code) const;
  void look_over(const ObjectLine& line, double begin, double end, const TileCodes& codes, Horizon& seen) const;

  const ArchiveReader& archive_;
  GroundScale scale_;
  TileGrid grid_m_;         ///< whose lengths are metres
  WorldPoint towards_sun_;  ///< of length 1
  SweptSun sun_;            ///< falls in elevation units
  double units_;            ///< of elevation in one metre
  double elevation_deg_;
  double radius_deg_;
  double above_;
  double highest_;  ///< elevation of all tiles
};

}  // namespace isohf
