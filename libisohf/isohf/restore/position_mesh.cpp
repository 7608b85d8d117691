#include "isohf/restore/position_mesh.h"

#include <algorithm>
#include <array>
#include <utility>

#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr std::int64_t kStep = 32;
constexpr std::int64_t kMostCells = std::int64_t{1} << 20;

/// Four neighbouring nodes and the weights of the cubic through them.
struct CubicTaps {
  std::int64_t first;
  std::array<double, 4> weights;
};

CubicTaps taps_at(std::int64_t sample, std::int64_t samples, std::int64_t cells) {
  const double position =
      samples > 1 ? static_cast<double>(sample) * static_cast<double>(cells) / static_cast<double>(samples - 1) : 0.0;
  const std::int64_t first = std::clamp<std::int64_t>(static_cast<std::int64_t>(position) - 1, 0, cells - 3);
  const double t = position - static_cast<double>(first);
  const double a = t;
  const double b = t - 1.0;
  const double c = t - 2.0;
  const double d = t - 3.0;
  return {first, {b * c * d / -6.0, a * c * d / 2.0, a * b * d / -2.0, a * b * c / 6.0}};
}

}  // namespace

std::int64_t PositionMesh::cells(std::int64_t samples, std::int64_t step) {
  return std::max<std::int64_t>((samples - 1 + step - 1) / step, 3);
}

std::int64_t PositionMesh::step(std::int64_t columns, std::int64_t rows) {
  std::int64_t step = kStep;
  while (cells(columns, step) > kMostCells / cells(rows, step)) step *= 2;
  return step;
}

std::size_t PositionMesh::value_count(std::int64_t columns, std::int64_t rows) {
  const std::int64_t between = step(columns, rows);
  return 2 * static_cast<std::size_t>(cells(columns, between) + 1) * static_cast<std::size_t>(cells(rows, between) + 1);
}

PositionMesh::PositionMesh(std::int64_t columns, std::int64_t rows, std::vector<double> values)
    : columns_(columns), rows_(rows), step_(step(columns, rows)), values_(std::move(values)) {
  ISOHF_ASSERT(values_.size() == value_count(columns, rows));
}

void PositionMesh::row(std::int64_t row, std::span<WorldPoint> out) const {
  ISOHF_ASSERT(out.size() == static_cast<std::size_t>(columns_));
  const auto nodes = static_cast<std::size_t>(cells(columns_, step_) + 1);
  const CubicTaps down = taps_at(row, rows_, cells(rows_, step_));
  std::vector<WorldPoint> line(nodes);
  for (std::size_t i = 0; i < nodes; ++i) {
    for (std::size_t j = 0; j < 4; ++j) {
      const double* const node = values_.data() + 2 * ((static_cast<std::size_t>(down.first) + j) * nodes + i);
      line[i].x += down.weights[j] * node[0];
      line[i].z += down.weights[j] * node[1];
    }
  }
  const std::int64_t all = cells(columns_, step_);
  for (std::int64_t column = 0; column < columns_; ++column) {
    const CubicTaps across = taps_at(column, columns_, all);
    WorldPoint place{0.0, 0.0};
    for (std::size_t i = 0; i < 4; ++i) {
      const WorldPoint& node = line[static_cast<std::size_t>(across.first) + i];
      place.x += across.weights[i] * node.x;
      place.z += across.weights[i] * node.z;
    }
    out[static_cast<std::size_t>(column)] = place;
  }
}

}  // namespace isohf
