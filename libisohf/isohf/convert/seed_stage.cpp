#include "isohf/convert/seed_stage.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/task_arena.h>

#include <limits>
#include <utility>

#include "isohf/base/assert.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

/// Bytes kept of one visible row of a tile: about four casters of its own and three that enter, either way, and as much
/// again while a row of tiles is finished (measured).
constexpr std::uint64_t kBytesPerRow = 2 * (2 * 7 * sizeof(ShadowCaster) + 32);

}  // namespace

void check_seed_request(const ShadowSeedRequest& request, const TileGrid& grid) {
  const auto check = [](const char* option, double degrees) {
    if (degrees >= kMinSunDeg && degrees < 90.0) return;
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("{} is {} degrees, must be a sun elevation from {} to below 90", option, degrees, kMinSunDeg));
  };
  check("--sun-min", request.sun_min_deg);
  for (std::size_t i = 0; i < request.sun_deg.size(); ++i) {
    check("--shadow-seeds", request.sun_deg[i]);
    if (i > 0 && request.sun_deg[i] <= request.sun_deg[i - 1]) {
      throw Error(ErrorCode::kInvalidArgument, "--shadow-seeds: the sun elevations must ascend");
    }
  }
  if (request.sun_deg.size() > kMaxSeedAngles) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("--shadow-seeds: {} sun elevations, at most {} are possible",
                                                         request.sun_deg.size(), kMaxSeedAngles));
  }
  if (!has_room_for_seeds(grid)) {
    throw Error(
        ErrorCode::kUnsupported,
        "--shadow-seeds: rows of 2^31 lattice vertices and more have no room for seeds; use a larger --spacing");
  }
}

std::uint64_t seed_stage_memory_bytes(const TileGrid& grid) {
  return static_cast<std::uint64_t>(grid.tile_columns()) * static_cast<std::uint64_t>(visible_rows(grid.shape())) *
         kBytesPerRow;
}

SeedStage::SeedStage(const TileGrid& grid, const Quantisation& quantisation, const ShadowSeedRequest& request,
                     double elevation_units_per_world_unit)
    : grid_(grid), quantisation_(quantisation) {
  info_.kind = request.sun_deg.empty() ? ShadowSeedInfo::Kind::kHulls : ShadowSeedInfo::Kind::kAngles;
  info_.sun_min_deg = request.sun_deg.empty() ? request.sun_min_deg : request.sun_deg.front();
  info_.sun_deg = request.sun_deg;
  info_.elevation_units_per_world_unit = elevation_units_per_world_unit;
  fall_min_ = info_.fall_per_half_step(grid, quantisation, info_.sun_min_deg);
  for (const double degrees : info_.sun_deg) falls_.push_back(info_.fall_per_half_step(grid, quantisation, degrees));
  // No code is below 0; how low floats go is only known at the end.
  lowest_ = quantisation.type == CodeType::kF32 ? -std::numeric_limits<double>::infinity() : 0.0;
}

SeedStage::Tile SeedStage::prepare(const TileCodes& codes) const {
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

std::int64_t SeedStage::first_tile_needed(const TileGrid& grid, std::int64_t next_tile) {
  return next_tile == 0 ? 0 : (next_tile - 1) / grid.tile_columns() * grid.tile_columns();
}

void SeedStage::add(TileIndex index, Tile tile, ArchiveWriter& writer) {
  ISOHF_ASSERT(static_cast<std::int64_t>(tiles_.size()) == index.column);
  tiles_.push_back(std::move(tile));
  if (static_cast<std::int64_t>(tiles_.size()) == grid_.tile_columns()) finish_row(index.row, writer);
}

std::vector<double> SeedStage::heights_at_angles(const CasterRows& rows) const {
  std::vector<double> heights;
  for (const double fall : falls_) {
    for (int row = 1; row <= visible_rows(grid_.shape()); ++row) {
      heights.push_back(shadow_height_from(rows.row(row), fall));
    }
  }
  return heights;
}

EncodedSeeds SeedStage::encode(const TileEdges& edges, const HullSeeds& seeds) const {
  if (info_.kind == ShadowSeedInfo::Kind::kHulls) {
    return seeds.empty() ? EncodedSeeds{} : encode_seeds(grid_, edges, seeds);
  }
  const AngleSeeds heights{heights_at_angles(seeds.eastward), heights_at_angles(seeds.westward)};
  return heights.empty() ? EncodedSeeds{} : encode_seeds(grid_, edges, heights, falls_.size());
}

void SeedStage::finish_row(std::int64_t row, ArchiveWriter& writer) {
  const TileShape& shape = grid_.shape();
  const std::size_t n = tiles_.size();
  std::vector<HullSeeds> seeds(n);
  std::vector<EncodedSeeds> encoded(n);
  // Isolated: a thread that waits here must not take a tile of the pipeline in hand and come back late.
  oneapi::tbb::this_task_arena::isolate([&] {
    oneapi::tbb::parallel_invoke(
        [&] {
          CasterRows handed = no_casters(shape);
          for (std::size_t i = 0; i < n; ++i) {
            CasterRows next = pass_on_casters(shape, handed, tiles_[i].casters.eastward, fall_min_, lowest_);
            seeds[i].eastward = std::exchange(handed, std::move(next));
          }
        },
        [&] {
          CasterRows handed = no_casters(shape);
          for (std::size_t i = n; i-- > 0;) {
            CasterRows next = pass_on_casters(shape, handed, tiles_[i].casters.westward, fall_min_, lowest_);
            seeds[i].westward = std::exchange(handed, std::move(next));
          }
        });
    oneapi::tbb::parallel_for(std::size_t{0}, n, [&](std::size_t i) {
      if (!tiles_[i].is_empty) encoded[i] = encode(tiles_[i].edges, seeds[i]);
    });
  });
  for (std::size_t i = 0; i < n; ++i) {
    if (encoded[i].payload_bytes == 0) continue;
    writer.add_deflated_member(seed_name({static_cast<std::int64_t>(i), row}), encoded[i].deflated,
                               encoded[i].payload_bytes, encoded[i].payload_crc32);
  }
  tiles_.clear();
}

ShadowSeedInfo SeedStage::info(const ArchiveWriter& writer) const {
  ShadowSeedInfo info = info_;
  const ArchiveWriter::MemberTotals totals = writer.members_in("seeds/");
  info.members = totals.members;
  info.bytes = totals.bytes;
  return info;
}

}  // namespace isohf
