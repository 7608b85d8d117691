#include "isohf/convert/stages/seed_row.h"

#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/task_arena.h>

#include <limits>
#include <utility>

namespace isohf {

SeedRow::SeedRow(const TileGrid& grid, const Quantisation& quantisation, const ShadowSeedInfo& info)
    : grid_(grid), quantisation_(quantisation) {
  const double sun_min_deg = info.kind == ShadowSeedInfo::Kind::kAngles ? info.sun_deg.front() : info.sun_min_deg;
  fall_min_ = info.fall_per_half_step(grid, quantisation, sun_min_deg);
  for (const double degrees : info.sun_deg) falls_.push_back(info.fall_per_half_step(grid, quantisation, degrees));
  // No code is below 0; how low floats go is only known at the end.
  lowest_ = quantisation.type == CodeType::kF32 ? -std::numeric_limits<double>::infinity() : 0.0;
}

SeedRow::Tile SeedRow::prepare(const TileCodes& codes) const {
  const TileShape& shape = grid_.shape();
  Tile tile;
  if (codes.type == CodeType::kF32) {
    tile.casters = tile_casters(shape, {codes.heights.data(), shape.columns(), shape.rows()}, fall_min_);
  } else {
    tile.casters = tile_casters(shape, {codes.codes.data(), shape.columns(), shape.rows()},
                                static_cast<std::uint16_t>(quantisation_.void_code()), fall_min_);
  }
  tile.edges = tile_edges(shape, codes);
  return tile;
}

std::vector<double> SeedRow::heights_at_angles(const CasterRows& rows) const {
  std::vector<double> heights;
  for (const double fall : falls_) {
    for (int row = 1; row <= visible_rows(grid_.shape()); ++row) {
      heights.push_back(shadow_height_from(rows.row(row), fall));
    }
  }
  return heights;
}

EncodedSeeds SeedRow::encode(const TileEdges& edges, const HullSeeds& seeds) const {
  if (falls_.empty()) {
    return seeds.empty() ? EncodedSeeds{} : encode_seeds(grid_, edges, seeds);
  }
  const AngleSeeds heights{heights_at_angles(seeds.eastward), heights_at_angles(seeds.westward)};
  return heights.empty() ? EncodedSeeds{} : encode_seeds(grid_, edges, heights, falls_.size());
}

std::vector<EncodedSeeds> SeedRow::encode(std::span<const Tile> tiles) const {
  const TileShape& shape = grid_.shape();
  const std::size_t n = tiles.size();
  std::vector<HullSeeds> seeds(n);
  std::vector<EncodedSeeds> encoded(n);
  // Isolated: a thread that waits here must not take a tile of the pipeline in hand and come back late.
  oneapi::tbb::this_task_arena::isolate([&] {
    oneapi::tbb::parallel_invoke(
        [&] {
          CasterRows handed = no_casters(shape);
          for (std::size_t i = 0; i < n; ++i) {
            CasterRows next = pass_on_casters(shape, handed, tiles[i].casters.eastward, fall_min_, lowest_);
            seeds[i].eastward = std::exchange(handed, std::move(next));
          }
        },
        [&] {
          CasterRows handed = no_casters(shape);
          for (std::size_t i = n; i-- > 0;) {
            CasterRows next = pass_on_casters(shape, handed, tiles[i].casters.westward, fall_min_, lowest_);
            seeds[i].westward = std::exchange(handed, std::move(next));
          }
        });
    oneapi::tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
      if (!tiles[i].is_empty) encoded[i] = encode(tiles[i].edges, seeds[i]);
    });
  });
  return encoded;
}

}  // namespace isohf
