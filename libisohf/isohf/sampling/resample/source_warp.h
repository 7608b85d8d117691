#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "isohf/lattice.h"
#include "isohf/projection/projection.h"
#include "isohf/projection/reference_map.h"

namespace isohf {

/// A source on a projected world: in degrees, or on another map.
struct WarpPlace {
  ProjectionSpec projection;
  MapPoint origin;         ///< where world (0, 0) lies on the map; x goes East from there, z South
  MapPoint first_sample;   ///< of source sample (0, 0): longitude and latitude, or a place of source_map
  double step_x = 1.0;     ///< between columns, > 0: degrees, or units of source_map
  double step_z = 1.0;     ///< between rows, > 0, southwards
  std::int64_t width = 0;  ///< source samples
  std::int64_t height = 0;
  std::shared_ptr<const ReferenceMap> source_map = nullptr;  ///< nullptr: the source is in degrees

  /// Columns all the way round the body; infinite on a map, which has ends.
  [[nodiscard]] double columns_round() const {
    return source_map ? std::numeric_limits<double>::infinity() : 360.0 / step_x;
  }
};

/// A place in the source, in samples: u along columns, v along rows.
struct SourcePosition {
  double u = 0.0;
  double v = 0.0;
};

/// World <-> source through the projection, place by place.
class ExactWarp {
 public:
  explicit ExactWarp(const WarpPlace& place);

  /// u is counted from the source's middle column, half way round to either side. NaN where the map shows no place.
  [[nodiscard]] SourcePosition source_from_world(WorldPoint world) const;
  [[nodiscard]] WorldPoint world_from_source(SourcePosition source) const;
  /// NaN where the source has no place for it.
  [[nodiscard]] SourcePosition source_from_geo(GeoPoint geo) const;
  [[nodiscard]] GeoPoint geo_from_world(WorldPoint world) const;
  /// On the world's map.
  [[nodiscard]] MapPoint map_from_geo(GeoPoint geo) const { return projection_.forward(geo); }
  [[nodiscard]] const WarpPlace& place() const { return place_; }

 private:
  WarpPlace place_;
  Projection projection_;
  double middle_longitude_;  ///< or easting
  double middle_u_;
  double turn_ = 0.0;  ///< once round the body, where the source's coordinates may lie on the other side of it; else 0
};

/// Where the vertices of tiles lie in the source: the inverse projection, approximated to kTolerance.
///
/// The lattice is covered with blocks that start at multiples of their size, whatever the tiles. On a block, u and v
/// are bicubic polynomials through 4 x 4 Chebyshev nodes, whose values are rounded to 1/4096 of a sample: that hides
/// the last bits in which mathematical libraries differ. Each polynomial is compared with the projection at 13 places,
/// where the first term that it lacks is largest, and where it is further off than a fifth of kTolerance the block is
/// cut in four; down to blocks of 8 x 8, whose vertices are computed one by one. So a position is a pure function of
/// its vertex.
class SourceWarp {
 public:
  static constexpr double kTolerance = 0.01;  ///< in samples, along either axis

  /// `reach`: samples beyond the source's edge that matter; places further out may come as NaN, unless it is infinite.
  SourceWarp(const TileGrid& grid, const WarpPlace& place, double reach);

  /// u, v [C x R] out, all stored vertices of the tile; u goes on beyond a turn where that is nearer to the neighbours.
  void positions(TileIndex tile, std::span<double> u, std::span<double> v) const;

  /// A place of the lattice, exactly; u as ExactWarp counts it, or on the turn nearest to near_u.
  [[nodiscard]] SourcePosition at(double x, double z) const;
  [[nodiscard]] SourcePosition at(double x, double z, double near_u) const;

  /// Bounds of v over all stored vertices of a row of tiles, from a few hundred places.
  struct RowBounds {
    double least;
    double most;
  };
  [[nodiscard]] RowBounds row_bounds(std::int64_t tile_row) const;
  /// The bounds of every row of tiles, widened so that neither end goes back from one to the next (around a pole it
  /// would): a source is read once, from North to South.
  [[nodiscard]] std::vector<RowBounds> reading_bounds() const;

  [[nodiscard]] const ExactWarp& exact() const { return exact_; }

 private:
  struct Block;
  struct Target;
  void fill(const Block& block, const Target& target) const;
  [[nodiscard]] bool is_beyond_reach(std::span<const SourcePosition> positions) const;

  TileGrid grid_;
  ExactWarp exact_;
  double reach_;
};

}  // namespace isohf
