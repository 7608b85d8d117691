#pragma once

#include <optional>
#include <string>

namespace isohf {

/// The six numbers of an ESRI world file: x = x0 + dx * column, y = y0 + dy * row at the samples' centres.
struct WorldFile {
  std::string path;
  double dx = 0.0;
  double dy = 0.0;
  double x0 = 0.0;
  double y0 = 0.0;

  [[nodiscard]] bool rows_from_south() const { return dy > 0.0; }
};

/// Looks beside raster.tif for raster.tfw, raster.tifw, those of other formats (.jgw, .pgw, ...) and raster.wld (any of
/// them in upper case); nullopt where none is. Throws Error: kCorrupt where one is but is not six numbers, kUnsupported
/// where it rotates the raster.
[[nodiscard]] std::optional<WorldFile> world_file_beside(const std::string& raster_path);

/// The text of raster.prj (or .PRJ) beside raster.tif; empty where none is. At most 64 KiB.
[[nodiscard]] std::string prj_beside(const std::string& raster_path);

}  // namespace isohf
