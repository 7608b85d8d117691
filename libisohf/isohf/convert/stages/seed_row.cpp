#include "isohf/convert/stages/seed_row.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "isohf/archive/writer.h"

namespace isohf {
namespace {

/// Bytes kept of one visible row of a tile: about four casters of its own and three that enter, either way, and as much
/// again while a row of tiles is finished (measured).
constexpr std::uint64_t kBytesPerRow = 2 * (2 * 7 * sizeof(ShadowCaster) + 32);
/// The ends of two buffers that stay in memory.
constexpr std::uint64_t kSpillBytes = std::uint64_t{16} << 20U;
/// Tiles whose members are made side by side.
constexpr std::size_t kTilesAtOnce = 64;

/// Returns where it is.
template <typename Value>
std::uint64_t append(SpillBuffer& bytes, const std::vector<Value>& values) {
  const std::uint64_t at = bytes.size_bytes();
  const std::uint64_t count = values.size();
  bytes.append(std::as_bytes(std::span(&count, 1)));
  bytes.append(std::as_bytes(std::span(values)));
  return at;
}

std::uint64_t append(SpillBuffer& bytes, const CasterRows& rows) {
  const std::uint64_t at = append(bytes, rows.starts);
  (void)append(bytes, rows.casters);
  return at;
}

/// Leaves `at` behind the values.
template <typename Value>
std::vector<Value> read(const SpillBuffer& bytes, std::uint64_t& at) {
  std::uint64_t count = 0;
  bytes.read(at, std::as_writable_bytes(std::span(&count, 1)));
  std::vector<Value> values(static_cast<std::size_t>(count));
  bytes.read(at + sizeof count, std::as_writable_bytes(std::span(values)));
  at += sizeof count + count * sizeof(Value);
  return values;
}

CasterRows read_casters(const SpillBuffer& bytes, std::uint64_t at) {
  CasterRows rows;
  rows.starts = read<std::uint32_t>(bytes, at);
  rows.casters = read<ShadowCaster>(bytes, at);
  return rows;
}

}  // namespace

SeedRow::SeedRow(const TileGrid& grid, const Quantisation& quantisation, const ShadowSeedInfo& info,
                 const WorldBounds& valid)
    : grid_(grid),
      quantisation_(quantisation),
      fall_min_(info.fall_per_half_step(grid, quantisation, info.sun_min_deg)),
      last_x_(last_casting_step(valid.x1, grid.sigma_x())),
      last_z_(last_casting_step(valid.z1, grid.sigma_z())) {}

TileCasters SeedRow::casters(const TileCodes& codes) const {
  const TileShape& shape = grid_.shape();
  if (codes.type == CodeType::kF32) {
    return tile_casters(shape, {codes.heights.data(), shape.columns(), shape.rows()}, fall_min_);
  }
  return tile_casters(shape, {codes.codes.data(), shape.columns(), shape.rows()},
                      static_cast<std::uint16_t>(quantisation_.void_code()), fall_min_);
}

SeedRow::Tile SeedRow::prepare(TileIndex index, const TileCodes& codes) const {
  const TileShape& shape = grid_.shape();
  const std::int64_t west = index.column * half_steps_across(shape);
  const std::int64_t north = index.row * shape.cell_rows();
  if (west + half_steps_across(shape) <= last_x_ && north + shape.cell_rows() <= last_z_) {
    return {casters(codes), tile_edges(shape, codes)};
  }
  TileCodes covered = codes;
  for (int row = 1; row <= visible_rows(shape); ++row) {
    for (int column = 1; column <= last_visible_column(shape, row); ++column) {
      if (west + object_x(shape.columns(), column, row) <= last_x_ && north + row - 1 <= last_z_) continue;
      const auto at = static_cast<std::size_t>(row * shape.columns() + column);
      if (codes.type == CodeType::kF32) {
        covered.heights[at] = std::numeric_limits<float>::quiet_NaN();
      } else {
        covered.codes[at] = static_cast<std::uint16_t>(quantisation_.void_code());
      }
    }
  }
  return {casters(covered), tile_edges(shape, codes)};
}

EncodedSeeds SeedRow::encode(const TileEdges& edges, const HullSeeds& seeds) const {
  return seeds.empty() ? EncodedSeeds{} : encode_seeds(grid_, edges, seeds);
}

void SeedRow::Tiles::add(const Tile& tile) {
  Place place{};
  place.type = tile.edges.type;
  place.is_empty = tile.is_empty;
  place.eastward = append(bytes_, tile.casters.eastward);
  place.westward = append(bytes_, tile.casters.westward);
  place.edges = append(bytes_, tile.edges.west);
  (void)append(bytes_, tile.edges.east);
  places_.push_back(place);
}

void SeedRow::Tiles::clear() {
  bytes_.clear();
  places_.clear();
}

void SeedRow::encode(const Tiles& tiles, const Take& take) const {
  const TileShape& shape = grid_.shape();
  const std::size_t count = tiles.count();
  // What light from the East brings into each tile, and then that from the West, on the way to the members.
  SpillBuffer westward(tiles.scratch_);
  std::vector<std::uint64_t> entering(count);
  CasterRows handed = no_casters(shape);
  for (std::size_t i = count; i-- > 0;) {
    entering[i] = append(westward, handed);
    handed = pass_on_casters(shape, handed, read_casters(tiles.bytes_, tiles.places_[i].westward), fall_min_);
  }
  handed = no_casters(shape);
  for (std::size_t first = 0; first < count; first += kTilesAtOnce) {
    const std::size_t end = std::min(first + kTilesAtOnce, count);
    std::vector<HullSeeds> seeds(end - first);
    std::vector<TileEdges> edges(end - first);
    for (std::size_t i = first; i < end; ++i) {
      const Tiles::Place& place = tiles.places_[i];
      seeds[i - first].westward = beyond_padding(read_casters(westward, entering[i]));
      CasterRows next = pass_on_casters(shape, handed, read_casters(tiles.bytes_, place.eastward), fall_min_);
      seeds[i - first].eastward = beyond_padding(std::exchange(handed, std::move(next)));
      std::uint64_t at = place.edges;
      edges[i - first].type = place.type;
      edges[i - first].west = read<double>(tiles.bytes_, at);
      edges[i - first].east = read<double>(tiles.bytes_, at);
    }
    std::vector<EncodedSeeds> encoded(end - first);
    // Isolated: a thread that waits here must not take a tile of the pipeline in hand and come back late.
    oneapi::tbb::this_task_arena::isolate([&] {
      oneapi::tbb::parallel_for(std::size_t{0}, encoded.size(), [&](std::size_t i) {
        if (!tiles.places_[first + i].is_empty) encoded[i] = encode(edges[i], seeds[i]);
      });
    });
    take(first, encoded);
  }
}

std::uint64_t SeedRow::memory_bytes(const TileGrid& grid, bool in_scratch) {
  const auto tiles = static_cast<std::uint64_t>(grid.tile_columns());
  const auto rows = static_cast<std::uint64_t>(visible_rows(grid.shape()));
  const std::uint64_t in_memory = tiles * rows * kBytesPerRow;
  if (!in_scratch) return in_memory;
  return std::min(in_memory, kSpillBytes + tiles * (sizeof(Tiles::Place) + sizeof(std::uint64_t)) +
                                 kTilesAtOnce * rows * kBytesPerRow);
}

void SeedRow::write(const Tiles& tiles, std::int64_t row, ArchiveWriter& writer) const {
  encode(tiles, [&](std::size_t first, std::span<const EncodedSeeds> members) {
    for (std::size_t i = 0; i < members.size(); ++i) {
      if (members[i].payload_bytes == 0) continue;
      writer.add_deflated_member(seed_name({static_cast<std::int64_t>(first + i), row}), members[i].deflated,
                                 members[i].payload_bytes, members[i].payload_crc32);
    }
  });
}

}  // namespace isohf
