// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

/// The isometric lattice: shape of a tile, places in it, and the grid of tiles (paper section 3).

namespace isohf {

/// The most stored columns a tile may have: object-space x reaches 2(C-4)+4, a signed 16-bit integer (errata E4).
inline constexpr int kMaxTileColumns = 1 << 14;
/// The most stored rows: object-space z reaches R-2 and grid indices stay in 16 bits.
inline constexpr int kMaxTileRows = (1 << 15) - 1;
/// The most levels: C-4 and (R-3)/2 hold a multiple of 2^13 within the limits above, none of 2^14.
inline constexpr int kMaxTileLevels = 14;

/// The validated shape of every tile of a heightfield: C columns and R rows of stored elevations, a one-vertex border
/// included, and Λ levels of detail (paper section 3, errata E1-E4).
///
/// Constraints: C >= 5, R >= 5, R odd, C-4 and (R-3)/2 integer multiples of 2^(Λ-1), C <= 2^14, R < 2^15, 1 <= Λ <= 14.
/// A function that is given a TileShape is total. Immutable, cheap to copy.
class TileShape {
 public:
  /// Throws Error{kInvalidArgument} that names the broken constraint and the nearest valid shape.
  static TileShape make(int columns, int rows, int levels);

  /// Why (columns, rows, levels) is no valid shape, one clause; empty where it is one.
  static std::string why_invalid(int columns, int rows, int levels);

  /// The valid shape nearest to the one asked for: levels are kept where they lie in 1..14, then columns and rows are
  /// rounded to the nearest that satisfy the constraints (ties upwards).
  static TileShape nearest(int columns, int rows, int levels);

  [[nodiscard]] int columns() const { return columns_; }  ///< C, padding included
  [[nodiscard]] int rows() const { return rows_; }        ///< R, padding included
  [[nodiscard]] int levels() const { return levels_; }    ///< Λ

  [[nodiscard]] int cell_columns() const { return columns_ - 4; }  ///< visible lattice steps from West to East
  [[nodiscard]] int cell_rows() const { return rows_ - 3; }        ///< visible rows of triangles

  /// C*R, the elevations stored for one tile.
  [[nodiscard]] std::int64_t stored_vertex_count() const { return std::int64_t{columns_} * rows_; }
  /// Vertices on visible triangles: C-3 on each of the (R-1)/2 odd rows, C-2 on each of the (R-3)/2 even rows.
  [[nodiscard]] std::int64_t visible_vertex_count() const;

  /// Visible triangles of the full-detail mesh, (2C-7)(R-3) (section 3); Eq. 4 at level 0.
  [[nodiscard]] std::int64_t triangle_count() const;
  /// Eq. 3 and Eq. 4: strip indices and its visible triangles at level 0 <= level < levels().
  [[nodiscard]] std::int64_t strip_index_count(int level) const;
  [[nodiscard]] std::int64_t strip_triangle_count(int level) const;
  /// Eq. 5 and Eq. 6: stitch triangles and indices that join level to the full-detail border; 0 at level 0.
  [[nodiscard]] std::int64_t stitch_triangle_count(int level) const;
  [[nodiscard]] std::int64_t stitch_index_count(int level) const;

  /// True aspect of the drawn triangles, (R-3)·sin60°/(C-4); 1 is equilateral (errata E3).
  [[nodiscard]] double aspect() const;
  /// The aspect that the paper prints in Table 1, R·sin60°/C. For comparison with the table only.
  [[nodiscard]] double printed_aspect() const;

  friend bool operator==(const TileShape&, const TileShape&) = default;

 private:
  TileShape(int columns, int rows, int levels) : columns_(columns), rows_(rows), levels_(levels) {}

  int columns_;
  int rows_;
  int levels_;
};

/// What a search for tile shapes is to keep near: triangles of the full-detail mesh, or stored vertices.
struct ShapeBudget {
  enum class Kind { kTriangles, kVertices };
  Kind kind = Kind::kTriangles;
  std::int64_t count = 10000;
};

/// The search behind Table 1 with the true aspect (errata E2, E3): shapes of `levels` levels whose count lies within
/// `tolerance` (a fraction, >= 0) of the budget, best |aspect - 1| first, ties by nearness to the budget, then fewer
/// columns; at most `limit`, all where it is negative. For each number of columns the two row counts within the budget
/// that are nearest to equilateral are considered. May be empty. O(2^14 / 2^levels) shapes.
/// Throws Error{kInvalidArgument} for levels outside 1..14, a budget below 1, or a negative or NaN tolerance.
std::vector<TileShape> find_shapes(int levels, const ShapeBudget& budget, double tolerance, int limit);

/// A row of the paper's Table 1, as printed.
struct Table1Row {
  int levels;
  int columns;
  int rows;
  double printed_aspect;
  bool valid;  ///< false for (48, 55) with Λ=3 (errata E1)
};

/// Table 1 of the paper, in its order.
const std::vector<Table1Row>& table1();

/// A stored vertex: column and row in the C x R elevation array.
struct GridVertex {
  int column;
  int row;
  friend bool operator==(const GridVertex&, const GridVertex&) = default;
};

/// A vertex in a tile's object space.
struct ObjectVertex {
  int x;
  int z;
  friend bool operator==(const ObjectVertex&, const ObjectVertex&) = default;
};

/// A position in a tile's object space.
struct ObjectPoint {
  double x;
  double z;
};

/// True for the vertices that Eq. 1 slides onto the straight West and East edges (column 1 or C-2 of even rows): they
/// lie half a lattice step off the infinite lattice and are sampled where they lie (errata E6).
[[nodiscard]] bool is_slid(const TileShape& shape, GridVertex vertex);

/// True for vertices on visible triangles.
[[nodiscard]] bool is_visible(const TileShape& shape, GridVertex vertex);

/// Eq. 1 with the padding of errata E5: the object-space place of a stored vertex, 0 <= column < C, 0 <= row < R.
[[nodiscard]] ObjectVertex object_from_grid(const TileShape& shape, GridVertex vertex);

/// Eq. 1's x alone, for loops over a row.
[[nodiscard]] inline int object_x(int tile_columns, int column, int row) {
  const int even = 1 - (row & 1);
  int slide = 0;
  if (even != 0) {
    if (column == 0) slide = 2;  // E5: the neighbour's vertex beside the edge
    if (column == 1) slide = 1;
    if (column == tile_columns - 2) slide = -1;
    if (column == tile_columns - 1) slide = -2;  // E5
  }
  return 2 * column + (row & 1) + slide - 3;
}

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
