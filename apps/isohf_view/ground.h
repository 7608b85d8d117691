#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <vector>

#include "gl/vec.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// The surface under the hand, on the triangles of full detail. Decodes the tiles that it is asked about and keeps the
/// last few; a tile that cannot be read counts as void. On one thread.
class Ground {
 public:
  explicit Ground(const TileSource& source) : source_(source), whole_(whole_bounds(source)) {}

  [[nodiscard]] const TileBounds& whole() const { return whole_; }

  /// Height at a place of `shown`, world units; nullopt where there is no surface.
  [[nodiscard]] std::optional<double> height(WorldPoint at);

  /// The most that the ground may reach up at a place, without a look at a tile; nullopt where nothing is stored.
  [[nodiscard]] std::optional<double> highest(WorldPoint at) const;

  /// The place where a ray first meets the surface; heights are those drawn, `exaggeration` times as high.
  /// direction  need not be a unit vector
  [[nodiscard]] std::optional<Vec3> hit(Vec3 eye, Vec3 direction, double exaggeration);

 private:
  struct Kept {
    TileIndex tile;
    std::vector<float> codes;  ///< [C x R], NaN void; empty: not readable
  };
  struct Ray {
    Vec3 from;
    Vec3 along;
    double exaggeration;
  };
  const Kept& kept(TileIndex tile);
  [[nodiscard]] double height_in(const Kept& tile, ObjectPoint point) const;  ///< NaN: void
  [[nodiscard]] std::optional<double> hit_in(const Kept& tile, const Ray& ray, double begin, double end) const;

  const TileSource& source_;
  TileBounds whole_;
  std::list<Kept> kept_;  ///< last used first
};

}  // namespace isohf::view
