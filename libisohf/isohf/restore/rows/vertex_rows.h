#pragma once

#include <cstdint>
#include <deque>
#include <variant>

#include "isohf/base/memory/kept_rows.h"
#include "isohf/restore/point_sampler.h"

namespace isohf {

/// The vertices of rows of tiles, row by row of vertices: codes as they are stored, of some tiles beside each other.
class VertexRows {
 public:
  /// first, last  columns of tiles
  VertexRows(const TileGrid& grid, const Quantisation& quantisation, ReadTile read_tile, std::int64_t first,
             std::int64_t last, const ScratchFolder& scratch);

  /// In memory, of the rows of tiles that so many lattice rows lie on; an estimate, of whole rows of tiles.
  [[nodiscard]] static double memory_bytes(const TileGrid& grid, double lattice_rows);

  /// Decodes a row of tiles, where it is not here. On the caller's oneTBB arena.
  void have(std::int64_t tile_row);
  [[nodiscard]] bool has_voids(std::int64_t tile_row) const;
  void drop_before(std::int64_t tile_row);

  /// Vertex row `row` of `tiles` tiles from column `first` on: [tiles * C]. From many threads at once.
  [[nodiscard]] TileCodes read(std::int64_t tile_row, int row, std::int64_t first, std::int64_t tiles) const;
  /// Of all of them.
  [[nodiscard]] TileCodes read(std::int64_t tile_row, int row) const {
    return read(tile_row, row, first_, last_ - first_ + 1);
  }

 private:
  struct TileRow {
    std::int64_t row;
    bool has_voids;
  };

  template <typename Rows, typename Values>
  void decode(std::int64_t tile_row, Rows& rows, const Values& values_of, bool& has_voids);
  [[nodiscard]] std::int64_t number(std::int64_t tile_row, int row) const {
    return tile_row * grid_.shape().rows() + row;
  }

  TileGrid grid_;
  Quantisation quantisation_;
  ReadTile read_tile_;
  std::int64_t first_;
  std::int64_t last_;
  std::deque<TileRow> tile_rows_;  ///< from North to South
  std::variant<KeptRows<std::uint16_t>, KeptRows<float>> rows_;
};

/// Two rows of vertices between which triangles lie, of some tiles: what a row of places needs.
class TriangleRows {
 public:
  /// z  object space: of the places
  TriangleRows(const VertexRows& rows, const TileShape& shape, std::int64_t tile_row, double z, std::int64_t first,
               std::int64_t tiles);

  /// The place of a vertex of a tile in codes().
  [[nodiscard]] std::size_t at(std::int64_t tile, GridVertex vertex) const {
    return static_cast<std::size_t>(((vertex.row - top_) * tiles_ + tile - first_) * columns_ + vertex.column);
  }
  [[nodiscard]] const TileCodes& codes() const { return codes_; }
  /// On a triangle of a tile; NaN where a vertex of weight is void.
  [[nodiscard]] double elevation(const Quantisation& quantisation, std::int64_t tile, const Barycentric& where) const;

 private:
  int top_;
  std::int64_t first_;
  std::int64_t tiles_;
  std::int64_t columns_;
  TileCodes codes_;
};

}  // namespace isohf
