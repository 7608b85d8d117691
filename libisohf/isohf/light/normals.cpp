#include "isohf/light/normals.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace isohf {
namespace {

// Heights are subtracted as doubles: no sum of floats overflows there, whatever a damaged source holds, and the only
// roundings that show are those of the elevations and of the result.

constexpr Normal kNoNormal = {0.0F, 0.0F, 0.0F};

/// Reciprocals of the spacings.
struct Scale {
  explicit Scale(const TileGrid& grid) : per_x(1.0 / grid.sigma_x()), per_z(1.0 / grid.sigma_z()) {}
  double per_x;
  double per_z;
};

/// A row of elevations between its neighbours.
struct Rows {
  Rows(View2D<const float> elevations, int row)
      : north(elevations.row(row - 1)), here(elevations.row(row)), south(elevations.row(row + 1)), odd(row % 2 != 0) {}
  const float* north;
  const float* here;
  const float* south;
  bool odd;
};

/// The slopes at a vertex and the sum of all heights they depend on, NaN or infinite where one of them is void.
struct Slopes {
  double dx;
  double dz;
  double sum;
};

/// Chosen without a branch, so that a loop of these is vectorised.
inline Normal normal_of(const Slopes& slopes) {
  const bool known = std::abs(slopes.sum) <= std::numeric_limits<double>::max();
  const double scale = 1.0 / std::sqrt(slopes.dx * slopes.dx + 1.0 + slopes.dz * slopes.dz);
  const double x = known ? -slopes.dx * scale : 0.0;
  const double y = known ? scale : 1.0;
  const double z = known ? -slopes.dz * scale : 0.0;
  return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
}

/// Six neighbours. north and south point at the neighbour at x-1 in the rows above and below, here at the vertex.
inline Slopes inside(const float* north, const float* here, const float* south, double scale_x, double scale_z) {
  const double nw = north[0];
  const double ne = north[1];
  const double w = here[-1];
  const double p = here[0];
  const double e = here[1];
  const double sw = south[0];
  const double se = south[1];
  const double dx = (2.0 * (e - w) + ((se - sw) + (ne - nw))) * scale_x;
  const double dz = ((se - ne) + (sw - nw)) * scale_z;
  return {dx, dz, ((nw + ne) + (w + e)) + ((sw + se) + p)};
}

/// Six neighbours of which the one on the edge is half as far away; even rows, column 2 and C-3.
Slopes beside_edge(const Rows& rows, int c, bool west_near, bool east_near, const Scale& scale) {
  const double nw = rows.north[c - 1];
  const double ne = rows.north[c];
  const double w = rows.here[c - 1];
  const double p = rows.here[c];
  const double e = rows.here[c + 1];
  const double sw = rows.south[c - 1];
  const double se = rows.south[c];
  // Twice the fan's area in units of σx·σz.
  const double area = 12.0 - (west_near ? 2.0 : 0.0) - (east_near ? 2.0 : 0.0);
  const double dx = (2.0 * (e - w) + ((se - sw) + (ne - nw))) * (scale.per_x / area);
  const double dz = ((east_near ? 2.0 : 3.0) * (se - ne) + (west_near ? 2.0 : 3.0) * (sw - nw)) * (scale.per_z / area);
  return {dx, dz, ((nw + ne) + (w + e)) + ((sw + se) + p)};
}

/// Eight neighbours; odd rows, column 1 (west_edge) and C-3. Both tiles at the edge see the same eight in this order.
Slopes edge_odd(const Rows& rows, int c, bool west_edge, const Scale& scale) {
  // The slid vertices straight above and below: column 1 at the West edge, C-2 at the East edge.
  const float* north = rows.north + (west_edge ? c : c + 1);
  const float* south = rows.south + (west_edge ? c : c + 1);
  const double nw = north[-1];
  const double n = north[0];
  const double ne = north[1];
  const double w = rows.here[c - 1];
  const double p = rows.here[c];
  const double e = rows.here[c + 1];
  const double sw = south[-1];
  const double s = south[0];
  const double se = south[1];
  const double dx = (2.0 * (e - w) + ((se - sw) + (ne - nw))) * (scale.per_x / 12.0);
  const double dz = (((se - ne) + (sw - nw)) + (s - n)) * (scale.per_z / 6.0);
  return {dx, dz, (((nw + ne) + (w + e)) + ((sw + se) + (n + s))) + p};
}

/// Four neighbours; even rows, column 1 (west_edge) and C-2. Above and below lie the odd rows' edge vertices.
Slopes edge_even(const Rows& rows, int c, bool west_edge, const Scale& scale) {
  const double n = rows.north[west_edge ? c : c - 1];
  const double s = rows.south[west_edge ? c : c - 1];
  const double w = rows.here[c - 1];
  const double p = rows.here[c];
  const double e = rows.here[c + 1];
  return {(e - w) * (scale.per_x / 2.0), (s - n) * (scale.per_z / 2.0), ((n + s) + (w + e)) + p};
}

/// The columns first..last of a row are the vertices that inside() holds for; there may be none.
int first_inside(const Rows& rows) {
  return rows.odd ? 2 : 3;
}
int last_inside(int columns) {
  return columns - 4;
}

/// Any other visible vertex.
Normal near_edge(const Rows& rows, int c, int columns, const Scale& scale) {
  if (rows.odd) return normal_of(edge_odd(rows, c, c == 1, scale));
  if (c == 1 || c == columns - 2) return normal_of(edge_even(rows, c, c == 1, scale));
  return normal_of(beside_edge(rows, c, c == 2, c == columns - 3, scale));
}

/// Normals of inside vertices c..c+count-1 of a row, in pieces that fit the first-level cache: components apart, which
/// the compiler vectorises, then woven together.
void inside_normals(const Rows& rows, int first, int count, const Scale& scale, Normal* out) {
  constexpr int kPiece = 256;
  const double scale_x = scale.per_x / 12.0;
  const double scale_z = scale.per_z / 4.0;
  std::array<float, kPiece> x;
  std::array<float, kPiece> y;
  std::array<float, kPiece> z;
  for (int start = 0; start < count; start += kPiece) {
    const int size = std::min(kPiece, count - start);
    const float* here = rows.here + first + start;
    const float* north = rows.north + first + start - (rows.odd ? 0 : 1);
    const float* south = rows.south + first + start - (rows.odd ? 0 : 1);
    for (int i = 0; i < size; ++i) {
      const Normal normal = normal_of(inside(north + i, here + i, south + i, scale_x, scale_z));
      x[static_cast<std::size_t>(i)] = normal.x;
      y[static_cast<std::size_t>(i)] = normal.y;
      z[static_cast<std::size_t>(i)] = normal.z;
    }
    for (int i = 0; i < size; ++i) {
      const auto j = static_cast<std::size_t>(i);
      out[start + i] = {x[j], y[j], z[j]};
    }
  }
}

}  // namespace

void tile_normals(const TileGrid& grid, View2D<const float> elevations, View2D<Normal> normals) {
  const int columns = grid.shape().columns();
  const int tile_rows = grid.shape().rows();
  const Scale scale(grid);
  std::fill_n(normals.row(0), columns, kNoNormal);
  for (int row = 1; row < tile_rows - 1; ++row) {
    const Rows rows(elevations, row);
    Normal* out = normals.row(row);
    const int first = first_inside(rows);
    const int inside_end = std::max(first, last_inside(columns) + 1);
    const int visible_end = columns - (rows.odd ? 2 : 1);
    out[0] = kNoNormal;
    for (int c = 1; c < first; ++c) out[c] = near_edge(rows, c, columns, scale);
    inside_normals(rows, first, inside_end - first, scale, out + first);
    for (int c = inside_end; c < visible_end; ++c) out[c] = near_edge(rows, c, columns, scale);
    std::fill(out + visible_end, out + columns, kNoNormal);
  }
  std::fill_n(normals.row(tile_rows - 1), columns, kNoNormal);
}

Normal vertex_normal(const TileGrid& grid, View2D<const float> elevations, GridVertex vertex) {
  const int columns = grid.shape().columns();
  if (!is_visible(grid.shape(), vertex)) return kNoNormal;
  const Scale scale(grid);
  const Rows rows(elevations, vertex.row);
  const int c = vertex.column;
  if (c < first_inside(rows) || c > last_inside(columns)) return near_edge(rows, c, columns, scale);
  const int beside = c - (rows.odd ? 0 : 1);
  return normal_of(
      inside(rows.north + beside, rows.here + c, rows.south + beside, scale.per_x / 12.0, scale.per_z / 4.0));
}

}  // namespace isohf
