#include "isohf/restore/rows/vertex_rows.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <utility>

#include "isohf/archive/tile/quantise.h"
#include "isohf/base/assert.h"

namespace isohf {
namespace {

using CodeRows = KeptRows<std::uint16_t>;
using FloatRows = KeptRows<float>;

}  // namespace

VertexRows::VertexRows(const TileGrid& grid, const Quantisation& quantisation, ReadTile read_tile, std::int64_t first,
                       std::int64_t last, const ScratchFolder& scratch)
    : grid_(grid),
      quantisation_(quantisation),
      read_tile_(std::move(read_tile)),
      first_(first),
      last_(last),
      rows_(CodeRows(0, scratch)) {
  const auto width = static_cast<std::size_t>((last - first + 1) * grid.shape().columns());
  if (quantisation.type == CodeType::kF32) {
    rows_ = FloatRows(width, scratch);
  } else {
    rows_ = CodeRows(width, scratch);
  }
}

double VertexRows::memory_bytes(const TileGrid& grid, double lattice_rows) {
  const double tile_rows = std::min(std::ceil(lattice_rows / static_cast<double>(grid.shape().cell_rows())) + 1.0,
                                    static_cast<double>(grid.tile_rows()));
  return tile_rows * static_cast<double>(grid.tile_columns() * grid.shape().stored_vertex_count()) * sizeof(float);
}

template <typename Rows, typename Values>
void VertexRows::decode(std::int64_t tile_row, Rows& rows, const Values& values_of, bool& has_voids) {
  const int height = grid_.shape().rows();
  const auto columns = static_cast<std::size_t>(grid_.shape().columns());
  for (int row = 0; row < height; ++row) rows.add(number(tile_row, row));
  std::atomic<bool> any = false;
  for_each_tile(read_tile_, {first_, tile_row}, last_ - first_ + 1, [&](std::int64_t from, const TileCodes& tile) {
    const auto& values = values_of(tile);
    for (int row = 0; row < height; ++row)
      rows.write(number(tile_row, row), static_cast<std::size_t>(from) * columns,
                 std::span(values).subspan(static_cast<std::size_t>(row) * columns, columns));
    const auto is_void = [&](auto value) {
      return quantisation_.type == CodeType::kF32 ? std::isnan(static_cast<float>(value))
                                                  : static_cast<std::uint32_t>(value) == quantisation_.void_code();
    };
    if (!any.load(std::memory_order_relaxed) && std::any_of(values.begin(), values.end(), is_void)) any = true;
  });
  has_voids = any;
}

void VertexRows::have(std::int64_t tile_row) {
  const auto is_it = [tile_row](const TileRow& kept) { return kept.row == tile_row; };
  if (std::any_of(tile_rows_.begin(), tile_rows_.end(), is_it)) return;
  TileRow& made = tile_rows_.emplace_back(TileRow{tile_row, false});
  if (auto* const codes = std::get_if<CodeRows>(&rows_)) {
    decode(
        tile_row, *codes, [](const TileCodes& tile) -> const auto& { return tile.codes; }, made.has_voids);
  } else {
    decode(
        tile_row, std::get<FloatRows>(rows_), [](const TileCodes& tile) -> const auto& { return tile.heights; },
        made.has_voids);
  }
}

bool VertexRows::has_voids(std::int64_t tile_row) const {
  const auto found = std::find_if(tile_rows_.begin(), tile_rows_.end(),
                                  [tile_row](const TileRow& kept) { return kept.row == tile_row; });
  ISOHF_ASSERT(found != tile_rows_.end());
  return found->has_voids;
}

void VertexRows::drop_before(std::int64_t tile_row) {
  std::erase_if(tile_rows_, [&](const TileRow& kept) {
    if (kept.row >= tile_row) return false;
    for (int row = 0; row < grid_.shape().rows(); ++row) {
      std::visit([&](auto& rows) { rows.drop(number(kept.row, row)); }, rows_);
    }
    return true;
  });
}

TileCodes VertexRows::read(std::int64_t tile_row, int row, std::int64_t first, std::int64_t tiles) const {
  const auto columns = static_cast<std::size_t>(grid_.shape().columns());
  const auto from = static_cast<std::size_t>(first - first_) * columns;
  const auto count = static_cast<std::size_t>(tiles) * columns;
  TileCodes read;
  read.type = quantisation_.type;
  const auto take = [&](const auto& rows, auto& values) {
    const auto found = rows.read(number(tile_row, row), from, count, values);
    if (found.data() != values.data()) values.assign(found.begin(), found.end());
  };
  if (const auto* const codes = std::get_if<CodeRows>(&rows_)) {
    take(*codes, read.codes);
  } else {
    take(std::get<FloatRows>(rows_), read.heights);
  }
  return read;
}

TriangleRows::TriangleRows(const VertexRows& rows, const TileShape& shape, std::int64_t tile_row, double z,
                           std::int64_t first, std::int64_t tiles)
    // As barycentric() and fixed_triangle() have it.
    : top_(std::min(static_cast<int>(std::fmax(z, 0.0)), shape.cell_rows() - 1) + 1),
      first_(first),
      tiles_(tiles),
      columns_(shape.columns()),
      codes_(rows.read(tile_row, top_, first, tiles)) {
  const TileCodes below = rows.read(tile_row, top_ + 1, first, tiles);
  codes_.codes.insert(codes_.codes.end(), below.codes.begin(), below.codes.end());
  codes_.heights.insert(codes_.heights.end(), below.heights.begin(), below.heights.end());
}

double TriangleRows::elevation(const Quantisation& quantisation, std::int64_t tile, const Barycentric& where) const {
  double sum = 0.0;
  for (std::size_t i = 0; i < 3; ++i) {
    if (where.weights[i] <= 0.0) continue;
    sum += where.weights[i] * elevation_of_vertex(codes_, quantisation, at(tile, where.vertices[i]));
  }
  return sum;
}

}  // namespace isohf
