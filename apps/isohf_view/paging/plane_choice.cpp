#include "paging/plane_choice.h"

#include <array>
#include <unordered_set>
#include <utility>

namespace isohf::view {
namespace {

/// The choice while it is made, plane by plane.
class Choice {
 public:
  Choice(const Planes& planes, const PlaneWishes& wishes)
      : planes_(planes), wishes_(wishes), refined_(static_cast<std::size_t>(planes.count()) + 1) {}

  std::vector<ChosenTile> make(const TileRange& top) {
    std::vector<TileIndex> tiles;
    for_each_tile(top, [&](TileIndex tile) { tiles.push_back(tile); });
    std::vector<ChosenTile> chosen;
    for (int plane = planes_.count(); plane >= 0; --plane) {
      std::vector<TileIndex> below;
      for (const TileIndex tile : tiles) {
        const PlaneTile at{plane, tile};
        if (!wishes_.is_stored(at)) continue;
        if (plane > 0 && gives_way(at)) {
          refined_[static_cast<std::size_t>(plane)].insert(planes_.grid(plane).flat_index(tile));
          for_each_tile(planes_.below(plane, tile), [&](TileIndex child) { below.push_back(child); });
        } else {
          chosen.push_back({at, coarser_sides(at)});
        }
      }
      tiles = std::move(below);
    }
    return chosen;
  }

 private:
  /// A stored tile of the plane that is covered by a coarser one.
  [[nodiscard]] bool is_coarser(int plane, TileIndex tile) const {
    const TileGrid& grid = planes_.grid(plane);
    if (plane == planes_.count() || !grid.contains(tile) || !wishes_.is_stored({plane, tile})) return false;
    const auto above = static_cast<std::size_t>(plane) + 1;
    return refined_[above].count(planes_.grid(plane + 1).flat_index(planes_.above(tile))) == 0;
  }

  [[nodiscard]] bool gives_way(PlaneTile at) const {
    if (!wishes_.wants_finer(at)) return false;
    for (std::int64_t row = -1; row <= 1; ++row) {
      for (std::int64_t column = -1; column <= 1; ++column) {
        if (is_coarser(at.plane, {at.tile.column + column, at.tile.row + row})) return false;
      }
    }
    bool ready = true;
    for_each_tile(planes_.below(at.plane, at.tile), [&](TileIndex child) {
      const PlaneTile below{at.plane - 1, child};
      ready = ready && (!wishes_.is_stored(below) || wishes_.is_resident(below));
    });
    return ready;
  }

  [[nodiscard]] unsigned coarser_sides(PlaneTile at) const {
    const auto [column, row] = at.tile;
    constexpr std::array<TileSide, 4> kSides{TileSide::kWest, TileSide::kEast, TileSide::kNorth, TileSide::kSouth};
    const std::array<TileIndex, 4> beside{{{column - 1, row}, {column + 1, row}, {column, row - 1}, {column, row + 1}}};
    unsigned sides = 0;
    for (std::size_t i = 0; i < kSides.size(); ++i) {
      if (is_coarser(at.plane, beside[i])) sides |= 1U << static_cast<unsigned>(kSides[i]);
    }
    return sides;
  }

  const Planes& planes_;
  const PlaneWishes& wishes_;
  std::vector<std::unordered_set<std::int64_t>> refined_;  ///< by plane: tiles that gave way
};

}  // namespace

std::vector<ChosenTile> choose_tiles(const Planes& planes, const TileRange& top, const PlaneWishes& wishes) {
  return Choice(planes, wishes).make(top);
}

}  // namespace isohf::view
