#include "isohf/restore/predict/place_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::int64_t kStep = 32;
constexpr std::int64_t kMostCells = std::int64_t{1} << 20;
/// Of a cell, in the weights' argument.
constexpr std::int64_t kCellParts = std::int64_t{1} << 14U;
/// Nodes further away than this are none.
constexpr std::int64_t kFarthest = std::int64_t{1} << 40U;

/// Four neighbouring nodes and the weights of the cubic through them, in 65536ths that sum to 1.
struct CubicTaps {
  std::int64_t first;
  std::array<std::int64_t, 4> weights;
};

CubicTaps taps_at(std::int64_t sample, std::int64_t samples, std::int64_t cells) {
  const std::int64_t last = std::max<std::int64_t>(samples - 1, 1);
  const std::int64_t cell = sample * cells / last;
  const std::int64_t part = (sample * cells % last * kCellParts + last / 2) / last;
  const std::int64_t first = std::clamp<std::int64_t>(cell - 1, 0, cells - 3);
  const std::int64_t a = (cell - first) * kCellParts + part;
  const std::int64_t b = a - kCellParts;
  const std::int64_t c = a - 2 * kCellParts;
  const std::int64_t d = a - 3 * kCellParts;
  const auto rounded = [](std::int64_t product, std::int64_t divisor) {  // products of 2^42, the cube of a cell's parts
    divisor <<= 26U;
    return floor_divide(product + divisor / 2, divisor);
  };
  const std::int64_t w0 = rounded(-b * c * d, 6);
  const std::int64_t w2 = rounded(-a * b * d, 2);
  const std::int64_t w3 = rounded(a * b * c, 6);
  return {first, {w0, 65536 - w0 - w2 - w3, w2, w3}};
}

/// The cubic's value: the second node and shares of the differences from it, rounded, halves upwards.
template <typename Node>
FixedPlace blend(const CubicTaps& taps, const Node& node) {
  const FixedPlace base = node(taps.first + 1);
  if (base.x == FixedPlace::kNone) return {FixedPlace::kNone, 0};
  std::int64_t x = 0;
  std::int64_t z = 0;
  for (std::int64_t i = 0; i < 4; ++i) {
    const FixedPlace at = node(taps.first + i);
    if (at.x == FixedPlace::kNone) return {FixedPlace::kNone, 0};
    x += taps.weights[static_cast<std::size_t>(i)] * (at.x - base.x);
    z += taps.weights[static_cast<std::size_t>(i)] * (at.z - base.z);
  }
  return {base.x + ((x + 32768) >> 16U), base.z + ((z + 32768) >> 16U)};
}

/// Where node i lies by the plane through its neighbours in the West, North and North-West, 0 where there is none.
std::int64_t level(const std::vector<FixedPlace>& nodes, std::size_t i, std::size_t width,
                   std::int64_t FixedPlace::*axis) {
  const std::int64_t west = i % width > 0 ? nodes[i - 1].*axis : 0;
  const std::int64_t north = i >= width ? nodes[i - width].*axis : 0;
  const std::int64_t both = i % width > 0 && i >= width ? nodes[i - width - 1].*axis : 0;
  return west + north - both;
}

}  // namespace

std::int64_t PlaceMesh::cells(std::int64_t samples, std::int64_t step) {
  return std::max<std::int64_t>((samples - 1 + step - 1) / step, 3);
}

std::int64_t PlaceMesh::step(std::int64_t columns, std::int64_t rows) {
  std::int64_t step = kStep;
  while (cells(columns, step) > kMostCells / cells(rows, step)) step *= 2;
  return step;
}

std::size_t PlaceMesh::value_count(std::int64_t columns, std::int64_t rows) {
  const std::int64_t between = step(columns, rows);
  return 2 * static_cast<std::size_t>(cells(columns, between) + 1) * static_cast<std::size_t>(cells(rows, between) + 1);
}

PlaceMesh::PlaceMesh(std::int64_t columns, std::int64_t rows, const TileGrid& grid,
                     const std::function<WorldPoint(double column, double row)>& at)
    : columns_(columns),
      rows_(rows),
      across_(cells(columns, step(columns, rows))),
      down_(cells(rows, step(columns, rows))) {
  const auto position = [](std::int64_t node, std::int64_t cells, std::int64_t samples) {
    return static_cast<double>(node) * static_cast<double>(samples - 1) / static_cast<double>(cells);
  };
  for (std::int64_t j = 0; j <= down_; ++j) {
    for (std::int64_t i = 0; i <= across_; ++i) {
      const WorldPoint place = at(position(i, across_, columns), position(j, down_, rows));
      const double x = std::floor(place.x / grid.sigma_x() * 256.0 + 0.5);
      const double z = std::floor(place.z / grid.sigma_z() * 512.0 + 0.5);
      const bool is_there =
          std::abs(x) < static_cast<double>(kFarthest) && std::abs(z) < static_cast<double>(kFarthest);
      nodes_.push_back(is_there ? FixedPlace{static_cast<std::int64_t>(x), static_cast<std::int64_t>(z)}
                                : FixedPlace{FixedPlace::kNone, 0});
    }
  }
}

PlaceMesh::PlaceMesh(std::int64_t columns, std::int64_t rows, std::span<const std::byte> bytes)
    : columns_(columns),
      rows_(rows),
      across_(cells(columns, step(columns, rows))),
      down_(cells(rows, step(columns, rows))) {
  const std::size_t count = value_count(columns, rows);
  if (bytes.size() != count * sizeof(std::int64_t)) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("has {} bytes, must have {}", bytes.size(), count * sizeof(std::int64_t)));
  }
  ByteReader reader(bytes);
  nodes_.resize(count / 2);
  std::vector<bool> is_none(nodes_.size(), false);
  const auto width = static_cast<std::size_t>(across_ + 1);
  const auto add = [&](std::size_t i, std::int64_t FixedPlace::*axis, std::int64_t difference) {
    const bool is_small = difference > -4 * kFarthest && difference < 4 * kFarthest;
    const std::int64_t value = is_small ? level(nodes_, i, width, axis) + difference : kFarthest;
    if (std::abs(value) >= kFarthest)
      throw Error(ErrorCode::kCorrupt, fmt::format("node {} lies too far from the tiles", i));
    nodes_[i].*axis = value;
  };
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    const auto x = reader.read<std::int64_t>();
    const auto z = reader.read<std::int64_t>();
    is_none[i] = x == FixedPlace::kNone || z == FixedPlace::kNone;
    add(i, &FixedPlace::x, is_none[i] ? 0 : x);
    add(i, &FixedPlace::z, is_none[i] ? 0 : z);
  }
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (is_none[i]) nodes_[i].x = FixedPlace::kNone;
  }
}

std::vector<std::byte> PlaceMesh::bytes() const {
  std::vector<FixedPlace> nodes = nodes_;
  std::vector<std::byte> bytes;
  ByteWriter writer(bytes);
  const auto width = static_cast<std::size_t>(across_ + 1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const FixedPlace at{level(nodes, i, width, &FixedPlace::x), level(nodes, i, width, &FixedPlace::z)};
    const bool is_none = nodes[i].x == FixedPlace::kNone;
    writer.write(is_none ? FixedPlace::kNone : nodes[i].x - at.x);
    writer.write(is_none ? FixedPlace::kNone : nodes[i].z - at.z);
    if (is_none) nodes[i] = at;
  }
  return bytes;
}

void PlaceMesh::row(std::int64_t row, std::span<FixedPlace> out) const {
  ISOHF_ASSERT(out.size() == static_cast<std::size_t>(columns_));
  const CubicTaps down = taps_at(row, rows_, down_);
  std::vector<FixedPlace> line;
  for (std::int64_t i = 0; i <= across_; ++i) {
    line.push_back(
        blend(down, [&](std::int64_t j) { return nodes_[static_cast<std::size_t>(j * (across_ + 1) + i)]; }));
  }
  for (std::int64_t column = 0; column < columns_; ++column) {
    out[static_cast<std::size_t>(column)] =
        blend(taps_at(column, columns_, across_), [&](std::int64_t i) { return line[static_cast<std::size_t>(i)]; });
  }
}

}  // namespace isohf
