#pragma once

#include <memory>
#include <vector>

#include "memory_tiles.h"

namespace isohf::test {

/// The analytic surface with coarse planes, decimated vertex by vertex.
class MemoryPlanes final : public view::TileSource {
 public:
  explicit MemoryPlanes(const TileGrid& grid)
      : tiles_(grid), planes_(grid, plane_stride(grid.shape()), plane_count(grid, plane_stride(grid.shape())), false) {
    for (int plane = 1; plane <= planes_.count(); ++plane) coarse_.push_back(std::make_unique<Coarse>(*this, plane));
  }
  [[nodiscard]] const TileGrid& grid() const override { return tiles_.grid(); }
  [[nodiscard]] view::ViewScale scale() const override { return tiles_.scale(); }
  [[nodiscard]] view::TileBounds bounds(TileIndex tile) const override { return tiles_.bounds(tile); }
  void read(TileIndex tile, std::span<std::uint16_t> codes) const override { tiles_.read(tile, codes); }
  [[nodiscard]] const Planes* planes() const override { return &planes_; }
  [[nodiscard]] const view::TileSource& plane(int plane) const override {
    if (plane == 0) return *this;
    return *coarse_[static_cast<std::size_t>(plane) - 1];
  }

 private:
  class Coarse final : public view::TileSource {
   public:
    Coarse(const MemoryPlanes& whole, int plane) : whole_(whole), plane_(plane) {}
    [[nodiscard]] const TileGrid& grid() const override { return whole_.planes_.grid(plane_); }
    [[nodiscard]] view::ViewScale scale() const override { return whole_.scale(); }
    [[nodiscard]] WorldBounds covered() const override { return whole_.covered(); }
    [[nodiscard]] view::TileBounds bounds(TileIndex tile) const override {
      const isohf::TileRange range = whole_.planes_.below(plane_, tile);
      view::TileBounds all{false, false, 1e9, -1e9};
      for (std::int64_t row = range.first.row; row < range.end.row; ++row) {
        for (std::int64_t column = range.first.column; column < range.end.column; ++column) {
          const view::TileBounds one = whole_.plane(plane_ - 1).bounds({column, row});
          all = {true, false, std::min(all.low, one.low), std::max(all.high, one.high)};
        }
      }
      return all;
    }
    void read(TileIndex tile, std::span<std::uint16_t> codes) const override {
      const TileGrid& own = grid();
      std::size_t i = 0;
      for (int row = 0; row < own.shape().rows(); ++row) {
        for (int column = 0; column < own.shape().columns(); ++column) {
          const LatticeVertex at = own.lattice_vertex(tile, {column, row});
          codes[i++] =
              whole_.planes_.is_beyond(plane_, at) ? view::kVoidCode : analytic_code(whole_.planes_.place(plane_, at));
        }
      }
    }

   private:
    const MemoryPlanes& whole_;
    int plane_;
  };

  MemoryTiles tiles_;
  Planes planes_;
  std::vector<std::unique_ptr<Coarse>> coarse_;
};

}  // namespace isohf::test
