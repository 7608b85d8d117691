#include "isohf/convert/tile_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "isohf/archive/quantise.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

/// What a row of codes adds up to; as integers there is no rounding. 32 bits hold the sum of 2^16 codes.
struct CodeSum {
  std::uint32_t sum = 0;
  std::int32_t voids = 0;
  std::int32_t low = 0xffff;
  std::int32_t high = 0;
};

ISOHF_VECTORISED(CodeSum, sum_codes, (const std::uint16_t* codes, int count, std::int32_t void_code),
                 (codes, count, void_code)) {
  std::uint32_t sum = 0;
  std::int32_t voids = 0;
  std::int32_t low = 0xffff;
  std::int32_t high = 0;
  for (int i = 0; i < count; ++i) {
    const std::int32_t code = codes[i];
    const std::int32_t valid = code == void_code ? 0 : code;
    voids += code == void_code ? 1 : 0;
    sum += static_cast<std::uint32_t>(valid);
    low = code < low ? code : low;
    high = valid > high ? valid : high;
  }
  return {sum, voids, low, high};
}

}  // namespace

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
    const CodeSum found =
        sum_codes(tile.codes.data() + row + 1, last, static_cast<std::int32_t>(quantisation.void_code()));
    statistics.vertices += last;
    statistics.voids += found.voids;
    if (found.voids == last) continue;
    statistics.sum += quantisation.offset * static_cast<double>(last - found.voids) +
                      quantisation.scale * static_cast<double>(found.sum);
    statistics.min = std::min(statistics.min, elevation_from_code(quantisation, static_cast<std::uint32_t>(found.low)));
    statistics.max =
        std::max(statistics.max, elevation_from_code(quantisation, static_cast<std::uint32_t>(found.high)));
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
