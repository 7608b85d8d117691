#include "surface_scan.h"

#include <algorithm>
#include <vector>

#include "isohf/base/error.h"

namespace isohf::cli {

SurfaceScan::SurfaceScan(const ArchiveReader& archive, const SampleGrid& grid, RestoreMethod method,
                         ProgressDisplay& display, const std::atomic<bool>& cancel)
    : archive_(archive), grid_(grid), method_(method), display_(display), cancel_(cancel) {}

void SurfaceScan::run(const std::string& stage, const Take& take) const {
  SurfaceRows surface(
      archive_.grid(), archive_.metadata().wraps_x, archive_.metadata().quantisation,
      [&](TileIndex tile) { return archive_.read_tile(tile); }, grid_, method_);
  const std::int64_t rows_at_once = std::max<std::int64_t>((std::int64_t{1} << 20U) / grid_.width, 1);
  for (std::int64_t row = 0; row < grid_.height; row += rows_at_once) {
    const std::int64_t rows = std::min(rows_at_once, grid_.height - row);
    std::vector<double> elevations(static_cast<std::size_t>(rows * grid_.width));
    surface.read(row, rows, elevations);
    take(row, elevations);
    report_rows(display_, stage, row + rows, grid_.height, cancel_);
  }
}

void report_rows(ProgressDisplay& display, const std::string& stage, std::int64_t done, std::int64_t rows,
                 const std::atomic<bool>& cancel) {
  display.update(stage, "rows", done, rows);
  if (cancel.load()) throw Error(ErrorCode::kCancelled, "interrupted");
}

}  // namespace isohf::cli
