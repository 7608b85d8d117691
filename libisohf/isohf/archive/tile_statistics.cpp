#include "isohf/archive/tile_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// What a row of codes adds up to; as integers there is no rounding. 32 bits hold the sum of 2^16 codes.
struct CodeSum {
  std::uint32_t sum = 0;
  std::int32_t voids = 0;
  std::int32_t low = 0xffff;
  std::int32_t high = 0;
};

ISOHF_KERNEL CodeSum sum_codes(const std::uint16_t* codes, int count, std::int32_t void_code) {
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

/// The last lattice place within `length`. A vertex on the very edge must not depend on how its place was rounded.
std::int64_t last_within(double length, double sigma) {
  return static_cast<std::int64_t>(std::clamp(std::floor(length / sigma + 1e-6), -1.0, 9e15));
}

}  // namespace

void check_statistics_of(const Metadata& metadata) {
  for (const auto& [name, text] : metadata.extensions) {
    if (name != kStatisticsOfName || text == kStatisticsOfSource) continue;
    throw Error(ErrorCode::kCorrupt, fmt::format("metadata: {} is {}, must be {}", name, text, kStatisticsOfSource));
  }
}

CountedVertices::CountedVertices(const Metadata& metadata)
    : grid_(metadata.grid),
      wraps_x_(metadata.wraps_x),
      last_x_(last_within(metadata.valid.x1, grid_.sigma_x())),
      last_z_(last_within(metadata.valid.z1, grid_.sigma_z())) {}

CountedVertices::Columns CountedVertices::of_row(TileIndex tile, int row) const {
  const TileShape& shape = grid_.shape();
  Columns columns{1, shape.columns() - (row % 2 == 0 ? 2 : 3)};
  if ((row == 1 && tile.row > 0) || grid_.lattice_vertex(tile, {1, row}).z > last_z_) return {1, 0};
  if (tile.column > 0 || wraps_x_) columns.first = 2;
  while (columns.last >= columns.first && grid_.lattice_vertex(tile, {columns.last, row}).x > last_x_) --columns.last;
  return columns;
}

std::int64_t CountedVertices::of_tile(TileIndex tile) const {
  const int first = tile.row > 0 ? 2 : 1;
  const std::int64_t most = grid_.shape().rows() - 2;
  const std::int64_t last = std::min(most, 1 + last_z_ - grid_.lattice_vertex(tile, {1, 1}).z);
  std::int64_t count = 0;
  // Rows of one parity count the same columns.
  for (int row = first; row <= std::min<std::int64_t>(first + 1, last); ++row) {
    const Columns columns = of_row(tile, row);
    count += std::max(0, columns.last - columns.first + 1) * ((last - row) / 2 + 1);
  }
  return count;
}

TileStatistics tile_statistics(const CountedVertices& counted, TileIndex index, const TileCodes& tile,
                               const Quantisation& quantisation) {
  const TileShape& shape = counted.shape();
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
    const auto [first, last] = counted.of_row(index, r);
    const int count = last - first + 1;
    if (count <= 0) continue;
    const std::size_t at =
        static_cast<std::size_t>(r) * static_cast<std::size_t>(shape.columns()) + static_cast<std::size_t>(first);
    if (tile.type == CodeType::kF32) {
      for (int c = 0; c < count; ++c) {
        const float height = tile.heights[at + static_cast<std::size_t>(c)];
        add(double{height}, std::isnan(height));
      }
      continue;
    }
    const CodeSum found =
        vectorised<sum_codes>(tile.codes.data() + at, count, static_cast<std::int32_t>(quantisation.void_code()));
    statistics.vertices += count;
    statistics.voids += found.voids;
    if (found.voids == count) continue;
    statistics.sum += quantisation.offset * static_cast<double>(count - found.voids) +
                      quantisation.scale * static_cast<double>(found.sum);
    statistics.min = std::min(statistics.min, elevation_from_code(quantisation, static_cast<std::uint32_t>(found.low)));
    statistics.max =
        std::max(statistics.max, elevation_from_code(quantisation, static_cast<std::uint32_t>(found.high)));
  }
  return statistics;
}

TileStatistics void_statistics(const CountedVertices& counted, TileIndex index) {
  TileStatistics statistics;
  for (int r = 1; r <= counted.shape().rows() - 2; ++r) {
    const auto [first, last] = counted.of_row(index, r);
    statistics.vertices += std::max(last - first + 1, 0);
  }
  statistics.voids = statistics.vertices;
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
