#pragma once

#include <array>
#include <cstddef>

#include "isohf/base/view.h"
#include "isohf/lattice.h"

/// Which triangle holds a point, and its weights there (paper section 3.10, Table 2, Eq. 9, errata E11, E12).
///
/// Between two neighbouring rows every triangle has one side GI on one row and one vertex H on the other. With β the
/// point's share of the row of GI, and γ its place between the triangle's two slanted sides (0 at the side HG):
///
///   down                up                 West half triangles (East ones mirror them)
///     G -------- I             H                 G -- I           H
///      \        /            /   \               |   /            | \  .
///       \      /            /     \              |  /             |  \ .
///          H               G ----- I             H                G -- I
///
///   w_G = β(1-γ) = β-α,   w_H = 1-β,   w_I = βγ = α.
///
/// Table 2 names the vertices by their grid columns, which hold for the half triangles as well, but its α is right only
/// where grid columns advance evenly with x. Near the straight edges they do not (errata E12). The weights here are
/// taken in object space, where both kinds of triangle are what is drawn.

namespace isohf {

/// A point of the surface as a weighted sum of three vertices, in Table 2's order: G leftmost, H alone on its row, I
/// rightmost. Weights are >= 0 and sum to 1 within two roundings. All three vertices are visible.
struct Barycentric {
  std::array<GridVertex, 3> vertices;
  std::array<double, 3> weights;
};

/// The triangle of the full-detail mesh under a point of a tile, and the point's weights in it.
/// point  object space, x in [0, 2(C-4)], z in [0, R-3]; points outside are moved to the nearest point of the square,
/// NaN to any. On a side that two triangles share either may be named; the weights of the vertices off that side are 0,
/// so that interpolated values agree. O(1), cannot fail.
[[nodiscard]] Barycentric barycentric(const TileShape& shape, ObjectPoint point);

/// Points nearer than this to a side or a vertex, in lattice steps, lie on it for whoever asks for a place: places are
/// found by products and quotients, and next to a void the last bit of one would decide.
inline constexpr double kOnSide = 1e-9;
/// The same point, moved to the side or vertex that it lies on: the weights off it are 0.
[[nodiscard]] Barycentric snapped(Barycentric at);

/// Value of a per-vertex property at the point.
/// values [C x R], float or double; NaN is void. NaN where a vertex with weight > 0 is void; vertices of weight 0 are
/// not read, so that a point on a valid side is valid from both of its triangles.
template <typename T>
[[nodiscard]] double interpolate(const Barycentric& at, View2D<const T> values) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (at.weights[i] > 0.0) {
      sum += at.weights[i] * static_cast<double>(values(at.vertices[i].column, at.vertices[i].row));
    }
  }
  return sum;
}

}  // namespace isohf
