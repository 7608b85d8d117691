#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/write/raster_sink.h"

namespace isohf {

/// A raster that is cut into tiles, each as large as the others and sharing `overlap` samples with its neighbours.
struct TileCut {
  std::int64_t across = 1;
  std::int64_t down = 1;
  std::int64_t columns = 0;  ///< of a tile
  std::int64_t rows = 0;
  std::int64_t overlap = 0;
  bool is_cut = false;  ///< every file is named by its column and row then, even a single one
};

/// How a raster of `size` samples, columns and rows, is cut. If it is `free`, `size` becomes that of the nearest number
/// of whole tiles. Throws Error{kInvalidArgument} naming the nearest sizes if tiles do not come out whole, and if
/// overlap leaves a tile nothing of its own.
/// tile_size  samples of a tile; nullopt: the raster stays whole
[[nodiscard]] TileCut cut_into_tiles(std::pair<std::int64_t, std::int64_t>& size, bool free,
                                     const std::optional<std::pair<std::int64_t, std::int64_t>>& tile_size,
                                     std::int64_t overlap);

/// The files that a raster is cut into: NAME_x0_y0.r16, the North-West one, and on to the East and South; NAME.r16 if
/// it is whole.
///
/// Rows come from North to South, once for each group of tile columns: at most 64 columns are open at a time. The files
/// get their names together in finish(); without it nothing has changed.
class RasterTiles {
 public:
  using SpecOf = std::function<RasterSpec(std::int64_t column, std::int64_t row)>;  ///< of one tile

  RasterTiles(std::string path, const TileCut& cut) : path_(std::move(path)), cut_(cut) {}
  RasterTiles(const RasterTiles&) = delete;
  RasterTiles& operator=(const RasterTiles&) = delete;
  ~RasterTiles();

  [[nodiscard]] std::vector<std::string> names() const;
  /// Tiles of the same name and format beyond the last column or row, which a cut into more tiles left.
  [[nodiscard]] std::vector<std::string> others() const;

  [[nodiscard]] std::int64_t groups() const;
  /// The next rows are the raster's first, of which the tiles of this group take their part.
  void begin_group(std::int64_t group, SpecOf spec_of);
  /// Whole rows of the raster from `row` on. Throws Error as RasterSink does.
  void write(std::int64_t row, std::span<const std::byte> rows);
  /// After the last row of the last group: gives all files their names and removes others(), which it returns.
  std::vector<std::string> finish();
  /// The files that were written, those beside the rasters as well.
  [[nodiscard]] const std::vector<std::string>& written() const { return written_; }

 private:
  struct TileRow {
    std::int64_t row = 0;
    std::vector<std::unique_ptr<RasterSink>> sinks;
  };
  [[nodiscard]] std::string name(std::int64_t column, std::int64_t row) const;
  void open_row(std::int64_t row);
  void complete(TileRow& tiles);
  void write_part(TileRow& tiles, std::int64_t first, std::span<const std::byte> rows);

  std::string path_;
  TileCut cut_;
  SpecOf spec_of_;
  std::size_t sample_bytes_ = 0;
  std::int64_t first_column_ = 0;  ///< of the group
  std::int64_t columns_ = 0;
  std::int64_t next_row_ = 0;  ///< of tiles, to be opened
  std::vector<TileRow> open_;
  std::unique_ptr<RasterSink> first_;  ///< the North-West tile once written; its lock keeps other writers off all tiles
  std::vector<std::pair<std::int64_t, std::int64_t>> parts_;  ///< column and row of tiles that wait for their names
  std::vector<std::string> written_;
};

}  // namespace isohf
