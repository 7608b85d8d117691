#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/lattice.h"
#include "isohf/metadata.h"

/// The integers that samples are predicted with (docs/archive_format.md, section 7). They are kept in doubles, but no
/// number and no sum gets as far as 2^53: each operation is exact, whatever their order, fused or not, so that the
/// bits are the same on every machine and in every language.

namespace isohf {

/// Parts of a lattice step: 512ths of two units of object x, and of one unit of object z.
inline constexpr std::int64_t kPlaceParts = 512;

/// A place of the whole heightfield, counted in such parts from its North-West corner.
struct FixedPlace {
  std::int64_t x;
  std::int64_t z;

  /// Stands for "nowhere" in x.
  static constexpr std::int64_t kNone = INT64_MIN;
};

/// Quotients downwards; b > 0.
[[nodiscard]] constexpr std::int64_t floor_divide(std::int64_t a, std::int64_t b) {
  return a / b - (a % b < 0 ? 1 : 0);
}

/// Elevations as integers: offset + scale * (n / 2^bits) is one.
class FixedHeights {
 public:
  /// bits  as the archive's record says: for floats so few that the largest elevation stays below 2^30
  FixedHeights(const Quantisation& quantisation, int bits);

  /// The bits for an archive whose elevations are at most `largest` away from 0.
  [[nodiscard]] static int bits_for(const Quantisation& quantisation, double largest);
  /// Whether a reader can use them.
  [[nodiscard]] static bool are_valid(const Quantisation& quantisation, int bits);

  /// n of a tile's i-th vertex, NaN where void.
  [[nodiscard]] double at(const TileCodes& tile, std::size_t i) const;
  /// Of all C*R vertices.
  [[nodiscard]] std::vector<double> of(const TileCodes& tile) const;
  [[nodiscard]] double elevation(double n) const { return quantisation_.offset + quantisation_.scale * (n * unit_); }

 private:
  Quantisation quantisation_;
  double parts_;  ///< 2^bits
  double unit_;
};

/// The triangle under a place of a tile (lattice/barycentric.h), its weights in 1024ths.
struct FixedTriangle {
  std::array<GridVertex, 3> vertices;
  std::array<int, 3> weights;
};
/// place  in the tile's square
[[nodiscard]] FixedTriangle fixed_triangle(const TileShape& shape, FixedPlace place);

/// Height of the triangle: floor(sum / 1024 + 1/2), NaN where a vertex with a weight is void. height(vertex) gives n.
template <typename HeightAt>
[[nodiscard]] double fixed_height(const FixedTriangle& triangle, const HeightAt& height) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (triangle.weights[i] > 0) sum += triangle.weights[i] * height(triangle.vertices[i]);
  }
  return std::floor(sum * 0x1p-10 + 0.5);
}

/// The tile under a place and the place within it; places on an inner edge belong to the tile East or South of it.
struct FixedTilePlace {
  TileIndex tile;
  FixedPlace place;
};
/// False outside of the tiles.
[[nodiscard]] bool locate(const TileGrid& grid, FixedPlace place, FixedTilePlace& found);

}  // namespace isohf
