#pragma once

#include <cstdint>

#include "isohf/lattice/tile_mapping.h"
#include "isohf/lattice/tile_shape.h"

namespace isohf {

/// A tile's place in the grid of tiles, column before row.
struct TileIndex {
  std::int64_t column;
  std::int64_t row;
  friend bool operator==(const TileIndex&, const TileIndex&) = default;
};

/// A point of the ground plane in world space: x eastwards, z southwards, from the heightfield's North-West corner.
/// World units are metres where the source's units are known.
struct WorldPoint {
  double x;
  double z;
};

/// A vertex in the object space of the whole heightfield: tile object space continued across all tiles, so that a
/// vertex that two or four tiles share has one LatticeVertex. Integer; column step 2, row step 1.
struct LatticeVertex {
  std::int64_t x;
  std::int64_t z;
  friend bool operator==(const LatticeVertex&, const LatticeVertex&) = default;
};

/// A place on the surface: the tile that holds it and the position in that tile's object space.
struct TilePoint {
  TileIndex tile;
  ObjectPoint point;
};

/// The most tiles in one direction and in all.
inline constexpr std::int64_t kMaxTilesPerAxis = std::int64_t{1} << 24;
inline constexpr std::int64_t kMaxTiles = std::int64_t{1} << 32;
/// Tile extents, world units: wide enough for any unit, narrow enough that no spacing or its reciprocal overflows.
inline constexpr double kMinExtent = 1e-30;
inline constexpr double kMaxExtent = 1e30;

/// The grid of square tiles: shape, tile columns and rows, and extents (paper section 3.12, Eqs. 2 and 12-15, errata
/// E13: extents are world lengths). Immutable.
///
/// The extents of x and z are equal unless the tiles were fitted to the source's edge. World space starts at (0, 0),
/// the North-West corner of tile (0, 0).
class TileGrid {
 public:
  /// tile_columns, tile_rows >= 1, at most kMaxTilesPerAxis and kMaxTiles together; extents in [kMinExtent,
  /// kMaxExtent], world units. Throws Error{kInvalidArgument}.
  static TileGrid make(const TileShape& shape, std::int64_t tile_columns, std::int64_t tile_rows, double extent_x,
                       double extent_z);

  [[nodiscard]] const TileShape& shape() const { return shape_; }
  [[nodiscard]] std::int64_t tile_columns() const { return tile_columns_; }
  [[nodiscard]] std::int64_t tile_rows() const { return tile_rows_; }
  [[nodiscard]] std::int64_t tile_count() const { return tile_columns_ * tile_rows_; }
  [[nodiscard]] double extent_x() const { return extent_x_; }
  [[nodiscard]] double extent_z() const { return extent_z_; }

  /// Eq. 2: world units of one object-space x unit (half a column step), and of one row of triangles.
  [[nodiscard]] double sigma_x() const { return extent_x_ / (2.0 * shape_.cell_columns()); }
  [[nodiscard]] double sigma_z() const { return extent_z_ / shape_.cell_rows(); }

  [[nodiscard]] double world_width() const { return extent_x_ * static_cast<double>(tile_columns_); }
  [[nodiscard]] double world_height() const { return extent_z_ * static_cast<double>(tile_rows_); }

  /// Eq. 15: tileIndex = t_C + t_R * tileCols.
  [[nodiscard]] std::int64_t flat_index(TileIndex tile) const { return tile.column + tile.row * tile_columns_; }
  [[nodiscard]] TileIndex tile_at(std::int64_t flat) const { return {flat % tile_columns_, flat / tile_columns_}; }
  [[nodiscard]] bool contains(TileIndex tile) const {
    return tile.column >= 0 && tile.row >= 0 && tile.column < tile_columns_ && tile.row < tile_rows_;
  }
  /// True inside the heightfield's rectangle, its border included.
  [[nodiscard]] bool contains(WorldPoint point) const;

  /// Eqs. 12-14: the tile under a world point and the place inside it. A point on an inner edge belongs to the tile
  /// East or South of it; points on the East or South border of the whole belong to the last tile. Points outside are
  /// moved to the border, NaN to the North-West: ask contains() first.
  [[nodiscard]] TilePoint locate(WorldPoint point) const;

  /// The vertex's one name in the whole heightfield; padding of border tiles lies outside [0, width] x [0, height].
  [[nodiscard]] LatticeVertex lattice_vertex(TileIndex tile, GridVertex vertex) const;

  /// World place of a lattice vertex. A pure function of the vertex: every tile computes the same bits.
  [[nodiscard]] WorldPoint world_from_lattice(LatticeVertex vertex) const {
    return {static_cast<double>(vertex.x) * sigma_x(), static_cast<double>(vertex.z) * sigma_z()};
  }

  /// World place of an object-space point of a tile.
  [[nodiscard]] WorldPoint world_from_object(TileIndex tile, ObjectPoint point) const;

  friend bool operator==(const TileGrid&, const TileGrid&) = default;

 private:
  TileGrid(const TileShape& shape, std::int64_t tile_columns, std::int64_t tile_rows, double extent_x, double extent_z)
      : shape_(shape), tile_columns_(tile_columns), tile_rows_(tile_rows), extent_x_(extent_x), extent_z_(extent_z) {}

  TileShape shape_;
  std::int64_t tile_columns_;
  std::int64_t tile_rows_;
  double extent_x_;
  double extent_z_;
};

}  // namespace isohf
