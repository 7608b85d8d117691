#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <utility>

#include "formats/mosaic/mosaic_layout.h"
#include "formats/mosaic/tile_name.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Of the smaller tile's ground: more than neighbours share that overlap by a few samples.
constexpr double kMostShared = 0.2;
/// Pairs that lie otherwise than the others are looked at; each tile of an old cut is one of them.
constexpr std::size_t kPairsLookedAt = 16;

struct Tile {
  TileName name;
  const PlacedMember* placed;

  [[nodiscard]] double width() const { return static_cast<double>(placed->member.width) * placed->spacing_x; }
  [[nodiscard]] double height() const { return static_cast<double>(placed->member.height) * placed->spacing_y; }
};

[[noreturn]] void refuse(const Tile& tile, const Tile& other, const std::string& why) {
  throw Error(ErrorCode::kUnsupported,
              fmt::format("{}: is a tile of another cut than {}: {}; join the tiles of one cut alone",
                          tile.placed->member.path, other.placed->member.path, why));
}

/// Share of the smaller one's ground.
double shared_by(const Tile& a, const Tile& b) {
  const auto along = [](double a0, double a1, double b0, double b1) {
    return std::max(std::min(a1, b1) - std::max(a0, b0), 0.0);
  };
  const PlacedMember& p = *a.placed;
  const PlacedMember& q = *b.placed;
  const double x = along(p.origin_x, p.origin_x + a.width(), q.origin_x, q.origin_x + b.width());
  const double y = along(-p.origin_y, -p.origin_y + a.height(), -q.origin_y, -q.origin_y + b.height());
  return x * y / std::min(a.width() * a.height(), b.width() * b.height());
}

/// All tiles of a cut share one scale, which the .json beside each states.
void check_scales(const std::vector<Tile>& tiles, const std::vector<SampleKind>& kinds) {
  const SampleKind& first = kinds[tiles.front().placed->member.kind];
  for (const Tile& tile : tiles) {
    const SampleKind& ours = kinds[tile.placed->member.kind];
    if (ours.z_scale == first.z_scale && ours.z_offset == first.z_offset) continue;
    const auto is_described = [](const Tile& of) { return std::filesystem::exists(of.placed->member.path + ".json"); };
    if (!is_described(tile) || !is_described(tiles.front())) continue;
    refuse(tile, tiles.front(),
           fmt::format("its elevations are raw * {} + {}, not raw * {} + {}", ours.z_scale, ours.z_offset,
                       first.z_scale, first.z_offset));
  }
}

/// Tiles in rows and columns as their names count them.
void check_places(std::vector<Tile>& tiles) {
  std::vector<std::pair<const Tile*, const Tile*>> odd;
  for (const bool in_rows : {true, false}) {
    const auto line = [&](const Tile& tile) { return in_rows ? tile.name.row : tile.name.column; };
    const auto place = [&](const Tile& tile) { return in_rows ? tile.name.column : tile.name.row; };
    std::ranges::sort(tiles, {}, [&](const Tile& tile) { return std::pair(line(tile), place(tile)); });
    std::optional<double> step;
    for (std::size_t i = 1; i < tiles.size(); ++i) {
      const Tile& before = tiles[i - 1];
      const Tile& tile = tiles[i];
      if (line(before) != line(tile)) continue;
      const PlacedMember& p = *before.placed;
      const PlacedMember& q = *tile.placed;
      const double x = (q.origin_x - p.origin_x) / p.spacing_x;
      const double y = (q.origin_y - p.origin_y) / p.spacing_y;
      const double away = (in_rows ? x : y) / static_cast<double>(place(tile) - place(before));
      step = step.value_or(away);
      const bool is_level = std::abs(in_rows ? y : x) < 0.5 &&
                            (in_rows ? p.member.height == q.member.height : p.member.width == q.member.width);
      const bool is_regular =
          is_level && std::abs(away - *step) < 0.5 && std::abs(q.spacing_x / p.spacing_x - 1.0) < 1e-6;
      if (!is_regular && odd.size() < kPairsLookedAt) odd.emplace_back(&before, &tile);
    }
    for (const auto& [before, tile] : odd) {
      for (const Tile* one : {tile, before}) {
        for (const Tile& other : tiles) {
          if (&other == one || shared_by(*one, other) <= kMostShared) continue;
          const auto words = [](const Tile& of) {
            return fmt::format("{} x {} samples, {:.6g} apart", of.placed->member.width, of.placed->member.height,
                               of.placed->spacing_x);
          };
          refuse(*one, other, fmt::format("the two overlap and have {} and {}", words(*one), words(other)));
        }
      }
    }
    odd.clear();
  }
}

}  // namespace

void refuse_mixed_cuts(const std::vector<PlacedMember>& members, const std::vector<SampleKind>& kinds) {
  std::map<std::pair<std::string, std::string>, std::vector<Tile>> groups;
  for (const PlacedMember& placed : members) {
    if (auto name = TileName::of(placed.member.path)) {
      std::vector<Tile>& group = groups[{name->stem, name->extension}];
      group.push_back({std::move(*name), &placed});
    }
  }
  for (auto& [name, tiles] : groups) {
    check_places(tiles);
    check_scales(tiles, kinds);
  }
}

}  // namespace isohf
