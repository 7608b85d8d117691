#include "isohf/convert/tile_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "isohf/convert/quantiser.h"

namespace isohf {

TileStatistics tile_statistics(const TileShape& shape, const TileCodes& tile, const Quantisation& quantisation) {
  TileStatistics statistics;
  const auto add = [&](double elevation, bool is_void) {
    ++statistics.vertices;
    if (is_void) {
      ++statistics.voids;
      return;
    }
    statistics.sum += elevation;
    statistics.min = std::min(statistics.min, elevation);
    statistics.max = std::max(statistics.max, elevation);
  };
  for (int r = 1; r <= shape.rows() - 2; ++r) {
    const int last = shape.columns() - (r % 2 == 0 ? 2 : 3);
    const std::size_t row = static_cast<std::size_t>(r) * static_cast<std::size_t>(shape.columns());
    if (tile.type == CodeType::kF32) {
      for (int c = 1; c <= last; ++c) {
        const float height = tile.heights[row + static_cast<std::size_t>(c)];
        add(double{height}, std::isnan(height));
      }
      continue;
    }
    // Codes are summed as integers: no rounding, and the loop vectorises.
    std::uint64_t sum = 0;
    std::uint32_t low = 0xFFFFFFFFU;
    std::uint32_t high = 0;
    std::int64_t voids = 0;
    for (int c = 1; c <= last; ++c) {
      const std::uint32_t code = tile.codes[row + static_cast<std::size_t>(c)];
      const bool is_void = code == quantisation.void_code();
      voids += is_void ? 1 : 0;
      sum += is_void ? 0U : code;
      low = !is_void && code < low ? code : low;
      high = !is_void && code > high ? code : high;
    }
    statistics.vertices += last;
    statistics.voids += voids;
    if (voids == last) continue;
    statistics.sum +=
        quantisation.offset * static_cast<double>(last - voids) + quantisation.scale * static_cast<double>(sum);
    statistics.min = std::min(statistics.min, elevation_from_code(quantisation, low));
    statistics.max = std::max(statistics.max, elevation_from_code(quantisation, high));
  }
  return statistics;
}

Statistics total_statistics(const TileStatistics& all) {
  Statistics statistics;
  statistics.vertices = all.vertices;
  statistics.voids = all.voids;
  statistics.clamped = all.clamped;
  statistics.worst_rounding = all.worst_rounding;
  if (all.voids < all.vertices) {
    statistics.min = all.min;
    statistics.max = all.max;
    statistics.mean = all.sum / static_cast<double>(all.vertices - all.voids);
  }
  return statistics;
}

}  // namespace isohf
