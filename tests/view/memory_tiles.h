#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/metadata.h"
#include "paging/tile_source.h"
#include "support/rasters/analytic_surface.h"

namespace isohf::test {

/// The analytic surface as a tile source; `alter` may change a tile's codes, `before_read` may hold up whoever reads.
class MemoryTiles final : public view::TileSource {
 public:
  static constexpr view::ViewScale kScale{-20.0, 0.002};
  using Alter = std::function<void(TileIndex, std::vector<std::uint16_t>&)>;

  explicit MemoryTiles(const TileGrid& grid, Alter alter = {}, std::function<void()> before_read = {})
      : TileSource(view::facts_of(grid, kScale)), alter_(std::move(alter)), before_read_(std::move(before_read)) {
    for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) bounds_.push_back(measure(grid.tile_at(flat)));
  }

  [[nodiscard]] view::TileBounds bounds(TileIndex tile) const override {
    return bounds_[static_cast<std::size_t>(grid().flat_index(tile))];
  }
  void read(TileIndex tile, std::span<std::uint16_t> codes) const override {
    if (before_read_) before_read_();
    const auto made = make(tile);
    std::copy(made.begin(), made.end(), codes.begin());
    ++reads;
  }

  /// May change what shadows of a tile are computed from: codes.
  using AlterHeights = std::function<void(TileIndex, std::span<float>)>;
  void set_heights(AlterHeights alter) { alter_heights_ = std::move(alter); }
  void read_heights(TileIndex tile, std::span<float> heights) const override {
    TileSource::read_heights(tile, heights);
    if (alter_heights_) alter_heights_(tile, heights);
  }

  /// The share of the sun that rays find at every point.
  void set_share(float share) { share_ = share; }
  [[nodiscard]] std::vector<float> sun_shares(std::span<const WorldPoint> points, const Sun& sun) const override {
    if (!share_) return TileSource::sun_shares(points, sun);
    return std::vector<float>(points.size(), *share_);
  }

  /// On that planet or moon.
  void set_body(const std::string& body) { metadata_.emplace(grid()).source.body = body; }
  [[nodiscard]] const Metadata* metadata() const override { return metadata_ ? &*metadata_ : nullptr; }

  mutable std::atomic<int> reads{0};

 private:
  [[nodiscard]] view::TileBounds measure(TileIndex tile) const {
    const auto codes = make(tile);
    view::TileBounds bounds{false, 1e9, -1e9};
    for (const std::uint16_t code : codes) {
      if (code == view::kVoidCode) continue;
      bounds.stored = true;
      bounds.low = std::min(bounds.low, scale().offset + scale().scale * code);
      bounds.high = std::max(bounds.high, scale().offset + scale().scale * code);
    }
    return bounds;
  }
  [[nodiscard]] std::vector<std::uint16_t> make(TileIndex tile) const {
    auto codes = analytic_tile(grid(), tile);
    if (alter_) alter_(tile, codes);
    return codes;
  }

  Alter alter_;
  std::function<void()> before_read_;
  std::vector<view::TileBounds> bounds_;
  AlterHeights alter_heights_;
  std::optional<Metadata> metadata_;
  std::optional<float> share_;
};

}  // namespace isohf::test
