#include "isohf/archive/shadow_seeds/shadow_seed_reader.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kNone = -std::numeric_limits<double>::infinity();
/// Sun elevations closer than this are the same.
constexpr double kSameAngleDeg = 1e-9;

ShadowSeedInfo info_of(const ArchiveReader& archive) {
  const auto info = shadow_seed_info(archive.metadata());
  if (!info) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has no shadow seeds; convert with --shadow-seeds", archive.path()));
  }
  return *info;
}

}  // namespace

ShadowSeedReader::ShadowSeedReader(const ArchiveReader& archive)
    : archive_(archive), info_(info_of(archive)), members_(static_cast<std::size_t>(archive.grid().tile_count()), -1) {
  const auto& members = archive.members();
  for (std::size_t i = 0; i < members.size(); ++i) {
    const auto tile = tile_from_seed_name(members[i].name);
    if (tile && archive.grid().contains(*tile)) {
      members_[static_cast<std::size_t>(archive.grid().flat_index(*tile))] = static_cast<std::int64_t>(i);
    }
  }
}

bool ShadowSeedReader::covers(double sun_elevation_deg) const {
  if (!(sun_elevation_deg > 0.0 && sun_elevation_deg < 90.0)) return false;
  if (info_.kind == ShadowSeedInfo::Kind::kHulls) return sun_elevation_deg >= info_.sun_min_deg - kSameAngleDeg;
  return std::any_of(info_.sun_deg.begin(), info_.sun_deg.end(),
                     [&](double angle) { return std::abs(angle - sun_elevation_deg) <= kSameAngleDeg; });
}

std::vector<std::byte> ShadowSeedReader::payload(TileIndex index) const {
  if (!archive_.grid().contains(index)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: tile ({},{}) lies outside the grid", archive_.path(), index.column, index.row));
  }
  const std::int64_t member = members_[static_cast<std::size_t>(archive_.grid().flat_index(index))];
  if (member < 0) return {};
  return archive_.read_member(archive_.members()[static_cast<std::size_t>(member)]);
}

HullSeeds ShadowSeedReader::hulls(TileIndex index, const TileCodes& tile) const {
  if (info_.kind != ShadowSeedInfo::Kind::kHulls) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: its seeds are for certain angles", archive_.path()));
  }
  const std::vector<std::byte> bytes = payload(index);
  if (bytes.empty()) {
    CasterRows none;
    none.starts.assign(static_cast<std::size_t>(visible_rows(archive_.grid().shape())) + 1, 0);
    return {none, none};
  }
  try {
    return decode_hull_seeds(archive_.grid(), index, tile_edges(archive_.grid().shape(), tile), bytes);
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: member \"{}\"", archive_.path(), seed_name(index)));
  }
}

std::vector<double> ShadowSeedReader::entering(TileIndex index, const TileCodes& tile, LightTravel travel,
                                               double sun_elevation_deg) const {
  if (!covers(sun_elevation_deg)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has shadow seeds for {}, not for a sun elevation of {} degrees", archive_.path(),
                            info_.kind == ShadowSeedInfo::Kind::kHulls
                                ? fmt::format("{} degrees and more", info_.sun_min_deg)
                                : fmt::format("{} degrees", fmt::join(info_.sun_deg, ", ")),
                            sun_elevation_deg));
  }
  std::vector<double> heights = info_.kind == ShadowSeedInfo::Kind::kHulls
                                    ? entering_by_hulls(index, tile, travel, sun_elevation_deg)
                                    : entering_by_angle(index, tile, travel, sun_elevation_deg);
  const Quantisation& quantisation = archive_.metadata().quantisation;
  for (double& height : heights) height = quantisation.offset + quantisation.scale * height;
  return heights;
}

std::vector<double> ShadowSeedReader::entering_by_hulls(TileIndex index, const TileCodes& tile, LightTravel travel,
                                                        double sun_elevation_deg) const {
  const TileGrid& grid = archive_.grid();
  const double fall = info_.fall_per_half_step(grid, archive_.metadata().quantisation, sun_elevation_deg);
  const HullSeeds seeds = hulls(index, tile);
  const CasterRows& rows = travel == LightTravel::kEastward ? seeds.eastward : seeds.westward;
  std::vector<double> heights;
  for (int row = 1; row <= visible_rows(grid.shape()); ++row) {
    double height = kNone;
    for (const ShadowCaster& caster : rows.row(row)) {
      height = std::max(height, caster.height - static_cast<double>(caster.distance) * fall);
    }
    heights.push_back(height);
  }
  return heights;
}

std::vector<double> ShadowSeedReader::entering_by_angle(TileIndex index, const TileCodes& tile, LightTravel travel,
                                                        double sun_elevation_deg) const {
  const auto rows = static_cast<std::size_t>(visible_rows(archive_.grid().shape()));
  const std::vector<std::byte> bytes = payload(index);
  if (bytes.empty()) return std::vector<double>(rows, kNone);
  const auto nearest = std::min_element(info_.sun_deg.begin(), info_.sun_deg.end(), [&](double a, double b) {
    return std::abs(a - sun_elevation_deg) < std::abs(b - sun_elevation_deg);
  });
  try {
    const AngleSeeds seeds =
        decode_angle_seeds(archive_.grid(), tile_edges(archive_.grid().shape(), tile), info_.sun_deg.size(), bytes);
    const auto& heights = travel == LightTravel::kEastward ? seeds.eastward : seeds.westward;
    const auto first = heights.begin() + (nearest - info_.sun_deg.begin()) * static_cast<std::ptrdiff_t>(rows);
    return {first, first + static_cast<std::ptrdiff_t>(rows)};
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: member \"{}\"", archive_.path(), seed_name(index)));
  }
}

}  // namespace isohf
