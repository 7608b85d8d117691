#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "isohf/base/view.h"
#include "isohf/lattice.h"
#include "isohf/light/shadow.h"

/// A row of tiles with made-up codes, and its shadows by the definition: every vertex against every vertex before it.

namespace isohf {

struct ShadowWorld {
  static constexpr std::uint16_t kVoid = 65535;

  enum class Terrain { kNoise, kRidges, kPlateaus, kHoles, kFlat };

  ShadowWorld(const TileShape& shape, std::int64_t tiles, double extent, Terrain terrain, unsigned seed)
      : grid(TileGrid::make(shape, tiles, 1, extent, extent * 0.9)) {
    std::mt19937 random(seed);
    const std::int64_t width = tiles * half_steps_across(shape) + 1;
    codes.assign(static_cast<std::size_t>(visible_rows(shape)), {});
    for (auto& row : codes) {
      row.resize(static_cast<std::size_t>(width));
      double level = 30000;
      int run = 0;
      for (auto& code : row) {
        switch (terrain) {
          case Terrain::kNoise:
            level = static_cast<double>(random() % 65535);
            break;
          case Terrain::kPlateaus:
            if (random() % 8 == 0) level = static_cast<double>(random() % 6 * 9000);
            break;
          case Terrain::kFlat:
            break;
          default:
            level = std::clamp(level + static_cast<double>(random() % 4001) - 2000, 0.0, 65534.0);
        }
        if (terrain == Terrain::kHoles && run == 0 && random() % 20 == 0) run = static_cast<int>(random() % 30);
        code = run > 0 ? kVoid : static_cast<std::uint16_t>(level);
        if (run > 0) --run;
      }
    }
  }

  [[nodiscard]] const TileShape& shape() const { return grid.shape(); }
  [[nodiscard]] std::uint16_t code(std::int64_t tile, int column, int row) const {
    const std::int64_t x = tile * half_steps_across(shape()) + object_x(shape().columns(), column, row);
    return codes[static_cast<std::size_t>(row - 1)][static_cast<std::size_t>(x)];
  }

  /// C x R codes of a tile; what lies in the padding matters to nobody.
  [[nodiscard]] std::vector<std::uint16_t> tile_codes(std::int64_t tile) const {
    std::vector<std::uint16_t> out(static_cast<std::size_t>(shape().stored_vertex_count()), 54321);
    for (int row = 1; row <= visible_rows(shape()); ++row) {
      for (int column = 1; column <= last_visible_column(shape(), row); ++column) {
        out[static_cast<std::size_t>(row * shape().columns() + column)] = code(tile, column, row);
      }
    }
    return out;
  }
  [[nodiscard]] std::vector<float> tile_heights(std::int64_t tile) const {
    std::vector<float> out;
    for (const std::uint16_t c : tile_codes(tile)) out.push_back(c == kVoid ? NAN : static_cast<float>(c));
    return out;
  }

  /// S by the definition; `fall` in codes for one half step.
  [[nodiscard]] double shadow(std::int64_t tile, int column, int row, LightTravel travel, double fall) const {
    const std::int64_t here = tile * half_steps_across(shape()) + object_x(shape().columns(), column, row);
    double highest = kNoShadow;
    for (std::int64_t t = 0; t < grid.tile_columns(); ++t) {
      for (int c = 1; c <= last_visible_column(shape(), row); ++c) {
        const std::int64_t x = t * half_steps_across(shape()) + object_x(shape().columns(), c, row);
        const std::int64_t distance = travel == LightTravel::kEastward ? here - x : x - here;
        if (distance < 0 || code(t, c, row) == kVoid) continue;
        highest = std::max(highest, code(t, c, row) - static_cast<double>(distance) * fall);
      }
    }
    return highest;
  }

  TileGrid grid;
  std::vector<std::vector<std::uint16_t>> codes;  ///< by visible row and half step of the whole row of tiles
};

inline constexpr ShadowWorld::Terrain kAllTerrains[] = {ShadowWorld::Terrain::kNoise, ShadowWorld::Terrain::kRidges,
                                                        ShadowWorld::Terrain::kPlateaus, ShadowWorld::Terrain::kHoles,
                                                        ShadowWorld::Terrain::kFlat};
inline constexpr LightTravel kBothTravels[] = {LightTravel::kEastward, LightTravel::kWestward};

}  // namespace isohf
