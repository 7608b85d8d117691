#include "isohf/lattice/barycentric.h"

#include <algorithm>
#include <cmath>

namespace isohf {

Barycentric barycentric(const TileShape& shape, ObjectPoint point) {
  const int cells = shape.cell_columns();
  const double x = std::fmax(0.0, std::fmin(point.x, 2.0 * cells));
  const double z = std::fmax(0.0, std::fmin(point.z, shape.cell_rows()));
  // The row of triangles lies between an odd grid row with vertices at x = 0, 2, ..., 2n, column 1 + x/2, and an even
  // one with vertices at 0, 1, 3, ..., 2n-1, 2n, columns 1, 2, 3, ..., n+1, n+2.
  const int top = std::min(static_cast<int>(z), shape.cell_rows() - 1) + 1;
  const double below = z - (top - 1);
  const bool even_on_top = top % 2 == 0;
  const int even_row = even_on_top ? top : top + 1;
  const int odd_row = even_on_top ? top + 1 : top;
  const double even_share = even_on_top ? 1.0 - below : below;

  // Odd vertices k and k+1 enclose x. On this line of constant z, the triangle with the side between them spans
  // t = x - 2k in [even_share, 2 - even_share]; what is left on each side belongs to triangles with a side on the even
  // row and one vertex, k or k+1, on the odd row.
  const int k = std::min(static_cast<int>(x / 2.0), cells - 1);
  const double t = x - 2.0 * k;
  const double right_bound = 2.0 - even_share;
  if (t >= even_share && t <= right_bound) {
    return {{{{k + 1, odd_row}, {k + 2, even_row}, {k + 2, odd_row}}},
            {(right_bound - t) / 2.0, even_share, (t - even_share) / 2.0}};
  }
  const bool right = t > right_bound;
  const int alone = right ? k + 1 : k;
  const double from_alone = right ? t - 2.0 : t;
  double weight_g = (even_share - from_alone) / 2.0;
  double weight_i = (even_share + from_alone) / 2.0;
  if (alone == 0) {  // West half triangle: G slid to x = 0, I at x = 1
    weight_g = even_share - from_alone;
    weight_i = from_alone;
  }
  if (alone == cells) {           // East half triangle: G at x = 2n-1, I slid to x = 2n
    weight_g = 0.0 - from_alone;  // no negative zero
    weight_i = even_share + from_alone;
  }
  return {{{{alone + 1, even_row}, {alone + 1, odd_row}, {alone + 2, even_row}}},
          {weight_g, 1.0 - even_share, weight_i}};
}

Barycentric snapped(Barycentric at) {
  double& heaviest = *std::max_element(at.weights.begin(), at.weights.end());
  int off = 0;
  for (double& weight : at.weights) {
    if (weight > kOnSide) continue;
    heaviest += weight;
    weight = 0.0;
    ++off;
  }
  if (off == 2) heaviest = 1.0;
  return at;
}

}  // namespace isohf
