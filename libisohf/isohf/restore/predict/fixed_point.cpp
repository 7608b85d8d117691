#include "isohf/restore/predict/fixed_point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/archive/tile/quantise.h"

namespace isohf {
namespace {

/// Codes have 8 more bits, which makes 24; floats up to 30.
constexpr int kCodeBits = 8;
constexpr int kHeightBits = 30;
constexpr int kMostFloatBits = 200;

}  // namespace

FixedHeights::FixedHeights(const Quantisation& quantisation, int bits)
    : quantisation_(quantisation), parts_(std::ldexp(1.0, bits)), unit_(std::ldexp(1.0, -bits)) {}

int FixedHeights::bits_for(const Quantisation& quantisation, double largest) {
  if (quantisation.type != CodeType::kF32) return kCodeBits;
  if (!(largest > 0.0) || !std::isfinite(largest)) return 0;
  return std::clamp(kHeightBits - 2 - std::ilogb(largest), -kMostFloatBits,
                    kMostFloatBits);  // twice as large still fit
}

bool FixedHeights::are_valid(const Quantisation& quantisation, int bits) {
  return quantisation.type == CodeType::kF32 ? std::abs(bits) <= kMostFloatBits : bits == kCodeBits;
}

double FixedHeights::at(const TileCodes& tile, std::size_t i) const {
  if (tile.type != CodeType::kF32) {
    return tile.codes[i] == quantisation_.void_code() ? std::numeric_limits<double>::quiet_NaN()
                                                      : static_cast<double>(tile.codes[i]) * parts_;
  }
  constexpr auto kMost = static_cast<double>(std::int64_t{1} << kHeightBits);
  const double n = std::floor(static_cast<double>(tile.heights[i]) * parts_ + 0.5);
  return n < -kMost ? -kMost : (n > kMost ? kMost : n);  // NaN stays
}

std::vector<double> FixedHeights::of(const TileCodes& tile) const {
  const std::size_t count = tile.type == CodeType::kF32 ? tile.heights.size() : tile.codes.size();
  std::vector<double> heights(count);
  for (std::size_t i = 0; i < count; ++i) heights[i] = at(tile, i);
  return heights;
}

FixedTriangle fixed_triangle(const TileShape& shape, FixedPlace place) {
  const int cells = shape.cell_columns();
  const int top = std::min(static_cast<int>(place.z / kPlaceParts), shape.cell_rows() - 1) + 1;
  const auto below = static_cast<int>(place.z - (top - 1) * kPlaceParts);
  const bool even_on_top = top % 2 == 0;
  const int even_row = even_on_top ? top : top + 1;
  const int odd_row = even_on_top ? top + 1 : top;
  const int e = even_on_top ? static_cast<int>(kPlaceParts) - below : below;
  const int k = std::min(static_cast<int>(place.x / kPlaceParts), cells - 1);
  const auto t = 2 * static_cast<int>(place.x - k * kPlaceParts);
  if (t >= e && t <= 1024 - e) {
    return {{{{k + 1, odd_row}, {k + 2, even_row}, {k + 2, odd_row}}}, {1024 - e - t, 2 * e, t - e}};
  }
  const bool right = t > 1024 - e;
  const int alone = right ? k + 1 : k;
  const int from = right ? t - 1024 : t;
  FixedTriangle found{{{{alone + 1, even_row}, {alone + 1, odd_row}, {alone + 2, even_row}}},
                      {e - from, 1024 - 2 * e, e + from}};
  if (alone == 0) found.weights = {2 * (e - from), 1024 - 2 * e, 2 * from};  // half triangles at the edges
  if (alone == cells) found.weights = {-2 * from, 1024 - 2 * e, 2 * (e + from)};
  return found;
}

bool locate(const TileGrid& grid, FixedPlace place, FixedTilePlace& found) {
  const std::int64_t across = grid.shape().cell_columns() * kPlaceParts;
  const std::int64_t down = grid.shape().cell_rows() * kPlaceParts;
  if (place.x < 0 || place.z < 0 || place.x > across * grid.tile_columns() || place.z > down * grid.tile_rows()) {
    return false;
  }
  found.tile = {std::min(place.x / across, grid.tile_columns() - 1), std::min(place.z / down, grid.tile_rows() - 1)};
  found.place = {place.x - found.tile.column * across, place.z - found.tile.row * down};
  return true;
}

}  // namespace isohf
