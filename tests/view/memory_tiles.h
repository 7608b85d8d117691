#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "isohf/surface/shade/shadow.h"
#include "paging/tile_source.h"
#include "support/analytic_surface.h"

namespace isohf::test {

/// The analytic surface as a tile source; `alter` may change a tile's codes, `before_read` may hold up whoever reads.
/// With seeds() it has shadows, of the surface as altered.
class MemoryTiles final : public view::TileSource {
 public:
  using Alter = std::function<void(TileIndex, std::vector<std::uint16_t>&)>;

  explicit MemoryTiles(const TileGrid& grid, Alter alter = {}, std::function<void()> before_read = {})
      : grid_(grid), alter_(std::move(alter)), before_read_(std::move(before_read)) {
    for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) bounds_.push_back(measure(grid.tile_at(flat)));
  }

  [[nodiscard]] const TileGrid& grid() const override { return grid_; }
  [[nodiscard]] view::ViewScale scale() const override { return {-20.0, 0.002}; }
  [[nodiscard]] view::TileBounds bounds(TileIndex tile) const override {
    return bounds_[static_cast<std::size_t>(grid_.flat_index(tile))];
  }
  void read(TileIndex tile, std::span<std::uint16_t> codes) const override {
    if (before_read_) before_read_();
    const auto made = make(tile);
    std::copy(made.begin(), made.end(), codes.begin());
    ++reads;
  }

  /// May change what a tile is told of the shadows that enter it: rows 1 to R-2, codes.
  using AlterEntering = std::function<void(TileIndex, LightTravel, std::vector<double>&)>;
  /// Shadows for these suns from here on.
  void set_seeds(const ShadowSeedInfo& info, AlterEntering alter_entering = {}) {
    seeds_ = info;
    alter_entering_ = std::move(alter_entering);
  }
  [[nodiscard]] const ShadowSeedInfo* shadow_seeds() const override { return seeds_ ? &*seeds_ : nullptr; }

  /// By way of all tiles between this one and the sun.
  void read_lit(TileIndex tile, const view::RowSun& sun, std::span<std::uint16_t> codes,
                std::span<std::uint16_t> shadow) const override {
    read(tile, codes);
    const TileShape& shape = grid_.shape();
    const double fall = std::tan(sun.elevation_deg * std::numbers::pi / 180.0) / scale().scale;
    const bool east = sun.travel == LightTravel::kEastward;
    std::vector<double> entering(static_cast<std::size_t>(shape.rows() - 2), kNoShadow);
    std::vector<float> heights(codes.size());
    std::vector<float> lit(codes.size());
    for (std::int64_t c = east ? 0 : grid_.tile_columns() - 1;; c += east ? 1 : -1) {
      const auto made = make({c, tile.row});
      std::transform(made.begin(), made.end(), heights.begin(), [](std::uint16_t code) {
        return code == view::kVoidCode ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(code);
      });
      if (c == tile.column && alter_entering_) alter_entering_(tile, sun.travel, entering);
      tile_shadow(grid_, View2D<const float>(heights.data(), shape.columns(), shape.rows()), {sun.travel, fall},
                  entering, View2D<float>(lit.data(), shape.columns(), shape.rows()), entering);
      if (c == tile.column) break;
    }
    std::transform(lit.begin(), lit.end(), shadow.begin(),
                   [](float s) { return static_cast<std::uint16_t>(std::isfinite(s) ? std::round(s) : 0.0F); });
  }

  mutable std::atomic<int> reads{0};

 private:
  [[nodiscard]] view::TileBounds measure(TileIndex tile) const {
    const auto codes = make(tile);
    view::TileBounds bounds{false, false, 1e9, -1e9};
    for (const std::uint16_t code : codes) {
      if (code == view::kVoidCode) {
        bounds.has_voids = true;
        continue;
      }
      bounds.stored = true;
      bounds.low = std::min(bounds.low, scale().offset + scale().scale * code);
      bounds.high = std::max(bounds.high, scale().offset + scale().scale * code);
    }
    return bounds;
  }
  [[nodiscard]] std::vector<std::uint16_t> make(TileIndex tile) const {
    auto codes = analytic_tile(grid_, tile);
    if (alter_) alter_(tile, codes);
    return codes;
  }

  TileGrid grid_;
  Alter alter_;
  std::function<void()> before_read_;
  std::vector<view::TileBounds> bounds_;
  std::optional<ShadowSeedInfo> seeds_;
  AlterEntering alter_entering_;
};

}  // namespace isohf::test
