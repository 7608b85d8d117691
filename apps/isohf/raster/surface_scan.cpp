#include "raster/surface_scan.h"

#include <algorithm>
#include <vector>

#include "isohf/error.h"

namespace isohf::cli {

SurfaceScan::SurfaceScan(const ArchiveReader& archive, const OutputGrid& grid, RestoreMethod method,
                         ProgressDisplay& display, const std::atomic<bool>& cancel)
    : archive_(archive), grid_(grid), method_(method), display_(display), cancel_(cancel) {}

void SurfaceScan::run(const std::string& stage, const Take& take) const {
  const Metadata& metadata = archive_.metadata();
  const auto read_tile = [&](TileIndex tile) { return archive_.read_tile(tile); };
  if (grid_.degrees) {
    GeoRows surface(metadata, read_tile, *grid_.degrees);
    return run_over(surface, stage, take);
  }
  SurfaceRows surface(metadata.grid, metadata.wraps_x, metadata.quantisation, read_tile, grid_.world, method_);
  run_over(surface, stage, take);
}

template <typename Surface>
void SurfaceScan::run_over(Surface& surface, const std::string& stage, const Take& take) const {
  const std::int64_t width = grid_.world.width;
  const std::int64_t height = grid_.world.height;
  const std::int64_t rows_at_once = std::max<std::int64_t>((std::int64_t{1} << 20U) / width, 1);
  for (std::int64_t row = 0; row < height; row += rows_at_once) {
    const std::int64_t rows = std::min(rows_at_once, height - row);
    std::vector<double> elevations(static_cast<std::size_t>(rows * width));
    surface.read(row, rows, elevations);
    take(row, elevations);
    report_rows(display_, stage, row + rows, height, cancel_);
  }
}

void report_rows(ProgressDisplay& display, const std::string& stage, std::int64_t done, std::int64_t rows,
                 const std::atomic<bool>& cancel) {
  display.update(stage, "rows", done, rows);
  if (cancel.load()) throw Error(ErrorCode::kCancelled, "interrupted");
}

}  // namespace isohf::cli
