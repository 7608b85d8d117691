#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "formats/write/raster_sink.h"
#include "isohf/restore/sample_grids.h"

namespace isohf::cli {

/// The files that a raster is cut into: NAME_x0_y0.r16, the North-West one, and on to the East and South; NAME.r16
/// where no tiles were asked for.
///
/// Rows come from North to South, once for each group of tile columns: at most 64 columns are open at a time. The files
/// get their names together in finish(); without it there is what there was before.
class ExportTiles {
 public:
  using SpecOf = std::function<RasterSpec(std::int64_t column, std::int64_t row)>;  ///< of one tile

  ExportTiles(const std::string& output, const TileCut& cut, std::int64_t width);
  ExportTiles(const ExportTiles&) = delete;
  ExportTiles& operator=(const ExportTiles&) = delete;
  ~ExportTiles();

  [[nodiscard]] std::vector<std::string> names() const;
  [[nodiscard]] std::int64_t groups() const;
  [[nodiscard]] std::int64_t files() const { return cut_.across * cut_.down; }

  /// The next rows are the raster's first, of which the tiles of this group take their part.
  void begin_group(std::int64_t group, SpecOf spec_of);
  /// Whole rows of the raster from `row` on. Throws Error as RasterSink does.
  void write(std::int64_t row, std::span<const std::byte> rows);
  /// After the last row of the last group: gives all files their names and removes tiles of other cuts.
  void finish();
  /// What was written.
  [[nodiscard]] const std::vector<std::string>& written() const { return written_; }

  /// Tiles of another cut that finish() removed.
  [[nodiscard]] const std::vector<std::string>& removed() const { return removed_; }

  /// Tiles of the same name and format beyond the last column or row, which a cut of more tiles left.
  [[nodiscard]] std::vector<std::string> others() const;

 private:
  struct TileRow {
    std::int64_t row = 0;
    std::vector<std::unique_ptr<RasterSink>> sinks;
  };
  [[nodiscard]] std::string name(std::int64_t column, std::int64_t row) const;
  void open_row(std::int64_t row);
  void complete(TileRow& tiles);
  void write_part(TileRow& tiles, std::int64_t first, std::span<const std::byte> rows, std::size_t sample_bytes);

  std::string output_;
  TileCut cut_;
  std::int64_t width_;
  SpecOf spec_of_;
  std::int64_t first_column_ = 0;  ///< of the group
  std::int64_t columns_ = 0;
  std::int64_t next_row_ = 0;  ///< of tiles, to be opened
  std::vector<TileRow> open_;
  std::unique_ptr<RasterSink>
      first_;  ///< the North-West tile, once written; its lock keeps other writers from all tiles
  std::vector<std::pair<std::int64_t, std::int64_t>> parts_;  ///< column and row of tiles that wait for their names
  std::vector<std::string> written_;
  std::vector<std::string> removed_;
};

}  // namespace isohf::cli
