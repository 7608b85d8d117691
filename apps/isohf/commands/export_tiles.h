#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "formats/write/raster_sink.h"
#include "isohf/restore/sample_grids.h"

namespace isohf::cli {

/// The files that a raster is cut into: NAME_x0_y0.r16, the North-West one, and on to the East and South; NAME.r16
/// where no tiles were asked for.
///
/// Rows come from North to South, once for each group of tile columns: at most 64 columns are open at a time. Unless all
/// is written, what is new is removed again; what took an old file's place stays, as the old one is gone.
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
  /// What was written.
  [[nodiscard]] const std::vector<std::string>& written() const { return written_; }

 private:
  struct TileRow {
    std::int64_t row = 0;
    std::vector<std::unique_ptr<RasterSink>> sinks;
  };
  [[nodiscard]] std::string name(std::int64_t column, std::int64_t row) const;
  void open_row(std::int64_t row);
  void write_part(TileRow& tiles, std::int64_t first, std::span<const std::byte> rows, std::size_t sample_bytes);

  std::string output_;
  TileCut cut_;
  std::int64_t width_;
  SpecOf spec_of_;
  std::int64_t first_column_ = 0;  ///< of the group
  std::int64_t columns_ = 0;
  std::int64_t next_row_ = 0;  ///< of tiles, to be opened
  std::vector<TileRow> open_;
  std::int64_t finished_ = 0;  ///< tiles
  std::vector<std::string> written_;
  std::vector<std::string> new_;  ///< of these, where no file was before, unless all is written
};

}  // namespace isohf::cli
