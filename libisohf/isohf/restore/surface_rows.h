#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "isohf/archive/codec/tile_codes.h"
#include "isohf/lattice.h"
#include "isohf/metadata.h"
#include "isohf/restore/hex_rows.h"

namespace isohf {

/// How an elevation between the lattice's vertices is found.
enum class RestoreMethod {
  kBarycentric,  ///< on the triangles, as the renderer draws them
  kHex,          ///< by quintic B-splines along the rows and then down the columns; on the triangles beside voids
};

[[nodiscard]] std::string to_string(RestoreMethod method);                        ///< "barycentric", "hex"
[[nodiscard]] RestoreMethod restore_method_from_string(const std::string& text);  ///< throws Error{kInvalidArgument}

/// A grid of samples in world space.
struct SampleGrid {
  std::int64_t width = 0;
  std::int64_t height = 0;
  double first_x = 0.0;  ///< world place of sample (0, 0)
  double first_z = 0.0;
  double spacing_x = 1.0;  ///< > 0
  double spacing_z = 1.0;
};

/// The grid of the source that an archive was made from.
[[nodiscard]] SampleGrid source_grid(const SourceRecord& source);

/// The C*R elevations of a tile, vertical units; NaN where void.
[[nodiscard]] std::vector<double> elevations_of(const TileCodes& tile, const Quantisation& quantisation);

/// The surface of an archive at the samples of a grid, row by row from North to South.
///
/// Keeps the tile rows and lattice rows that the next rows may need: memory grows with the width, not the height.
/// Works on the caller's oneTBB arena. The bits depend on tiles and grid alone, not on threads or on how the rows are
/// cut into calls.
class SurfaceRows {
 public:
  /// Decodes one tile, wholly void ones too; called from many threads at once.
  using ReadTile = std::function<TileCodes(TileIndex)>;

  /// wraps_x  the grid's East edge is its West edge
  SurfaceRows(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation, ReadTile read_tile,
              const SampleGrid& samples, RestoreMethod method);

  /// Rows `first` to `first + rows - 1`; calls come in increasing order.
  /// elevations [rows * width] out, vertical units; NaN where the surface has a void or ends.
  void read(std::int64_t first, std::int64_t rows, std::span<double> elevations);

 private:
  struct TileRow {
    std::int64_t row;
    bool has_voids;
    std::vector<std::vector<double>> elevations;  ///< [tile columns][C*R]
  };
  struct LatticeRow {
    std::vector<double> heights;
    std::vector<char> near_void;
    bool any_near_void = false;
  };
  struct Column {
    bool inside;
    std::int64_t tile;
    double x;  ///< object space
  };

  const TileRow& tile_row(std::int64_t row);
  [[nodiscard]] const TileRow& kept_tile_row(std::int64_t row) const;
  void keep_lattice_rows(std::int64_t first, std::int64_t last);
  void read_on_triangles(const TilePoint& at, std::span<double> out) const;
  void read_row(std::int64_t row, std::span<double> out) const;
  void blend_lattice_rows(const QuinticResponse& response, bool beside_voids, std::span<double> out) const;
  [[nodiscard]] double world_z(std::int64_t row) const {
    return samples_.first_z + static_cast<double>(row) * samples_.spacing_z;
  }

  TileGrid grid_;
  Quantisation quantisation_;
  ReadTile read_tile_;
  SampleGrid samples_;
  RestoreMethod method_;
  HexRows hex_;
  std::vector<Column> columns_;
  std::deque<TileRow> tile_rows_;
  std::deque<LatticeRow> lattice_rows_;
  std::int64_t first_lattice_row_ = 0;
};

}  // namespace isohf
