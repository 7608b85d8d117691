#pragma once

#include <cstdint>
#include <vector>

#include "isohf/lattice.h"
#include "isohf/tile_range.h"

/// Coarse planes: the levels of detail (paper sections 3.4-3.8) carried on above a tile.
///
/// Plane 0 is the grid of tiles. A tile of plane p stands for S x S tiles of plane p-1 and so for F x F tiles, F = S^p.
/// Its vertex at (X, Z), continued over the plane's tiles as a LatticeVertex is, is the vertex of plane 0 at
/// (F·X, F·Z): F is even, so that is a visible vertex of an odd row, those that Eq. 1 slides included. What would lie
/// beyond the tiles of plane 0 is moved to their edge, place and elevation alike, so that every plane covers the same
/// ground to its very edge. What lies further beyond than the step of the coarsest level is part of no triangle that
/// has an area, and void.
///
/// One level of detail runs through all planes: level p·log2(S) + λ is level λ of plane p, and level 0 of plane p takes
/// the place of level log2(S) of plane p-1. The two are the same mesh, but for the vertices that the finer one has on
/// straight edges between tiles that the coarser one joins: there two halves make one triangle.

namespace isohf {

/// S for tiles of a shape: 8, or else 4, where C-4 and (R-3)/2 are multiples of it; 0 where there are no planes.
[[nodiscard]] int plane_stride(const TileShape& shape);
/// If tiles of a shape may have planes of this stride: a power of two >= 2 that divides C-4 and (R-3)/2.
[[nodiscard]] bool allows_planes(const TileShape& shape, int stride);
/// Planes above the tiles until one tile is left; stride a power of two >= 2.
[[nodiscard]] int plane_count(const TileGrid& grid, int stride);

/// All planes of a heightfield. Immutable.
class Planes {
 public:
  /// `count` planes above the tiles of `grid`; 0: none, and stride is not looked at. Otherwise stride is a power of two
  /// >= 2 of which C-4 and (R-3)/2 are multiples, and each tile of the last plane has less than 2^62 half steps.
  Planes(const TileGrid& grid, int stride, int count, bool wraps_x);

  [[nodiscard]] int stride() const { return stride_; }
  [[nodiscard]] int count() const { return static_cast<int>(grids_.size()) - 1; }
  /// Tiles of a plane, 0 <= plane <= count(); extents are those of F tiles, beyond the last tiles of plane 0 too.
  [[nodiscard]] const TileGrid& grid(int plane) const { return grids_[static_cast<std::size_t>(plane)]; }
  /// S^plane.
  [[nodiscard]] std::int64_t scale(int plane) const { return std::int64_t{1} << (plane * step_); }
  /// The tiles' shape with as many levels as planes take, log2(S)+1, or more: whose strips and stitch lists are drawn.
  [[nodiscard]] const TileShape& mesh_shape() const { return mesh_shape_; }

  /// Levels 0 to levels()-1 through all planes.
  [[nodiscard]] int levels() const { return count() * step_ + grid(0).shape().levels(); }
  /// The coarsest plane whose vertices lie no further apart than so many world units along x and z; 0 where none.
  [[nodiscard]] int plane_for_spacing(double step_x, double step_z) const;

  /// Where a vertex of a plane lies, in the lattice of plane 0: what the mesh is drawn at.
  [[nodiscard]] LatticeVertex place(int plane, LatticeVertex vertex) const { return place_in(0, plane, vertex); }
  /// True where it is further beyond the tiles of plane 0 than has an elevation: a void.
  [[nodiscard]] bool is_beyond(int plane, LatticeVertex vertex) const;

  /// The tile of plane+1 above a tile, and the tiles of plane-1 below one.
  [[nodiscard]] TileIndex above(TileIndex tile) const { return {tile.column / stride_, tile.row / stride_}; }
  [[nodiscard]] TileRange below(int plane, TileIndex tile) const;

  /// One coordinate of place(): where vertices of `plane` at x and z lie in a finer plane `below`, of which they are
  /// vertices likewise.
  [[nodiscard]] std::int64_t x_below(int below, int plane, std::int64_t x) const;
  [[nodiscard]] std::int64_t z_below(int below, int plane, std::int64_t z) const;

 private:
  [[nodiscard]] bool is_joined(int plane) const;
  [[nodiscard]] LatticeVertex place_in(int below, int plane, LatticeVertex vertex) const {
    return {x_below(below, plane, vertex.x), z_below(below, plane, vertex.z)};
  }

  int stride_;
  int step_ = 0;  ///< log2(S)
  bool wraps_x_;
  TileShape mesh_shape_;
  std::vector<TileGrid> grids_;
};

}  // namespace isohf
