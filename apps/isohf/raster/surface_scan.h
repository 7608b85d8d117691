#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "isohf/archive.h"
#include "isohf/restore/surface_rows.h"
#include "output/progress.h"
#include "raster/output_grid.h"

namespace isohf::cli {

/// The surface of an archive at the samples of a raster, from its first row to its last.
class SurfaceScan {
 public:
  /// Some whole rows from `first_row` on; NaN where void.
  using Take = std::function<void(std::int64_t first_row, std::span<const double> elevations)>;

  /// method   between vertices; a grid in degrees is read on the triangles, whatever it says
  /// `display` is told how far it has come; `cancel` is looked at between two calls of `take`.
  SurfaceScan(const ArchiveReader& archive, const OutputGrid& grid, RestoreMethod method, ProgressDisplay& display,
              const std::atomic<bool>& cancel);

  /// Works on the caller's oneTBB arena; about a million samples at a time. Throws Error{kCancelled}.
  void run(const std::string& stage, const Take& take) const;

 private:
  template <typename Surface>
  void run_over(Surface& surface, const std::string& stage, const Take& take) const;

  const ArchiveReader& archive_;
  OutputGrid grid_;
  RestoreMethod method_;
  ProgressDisplay& display_;
  const std::atomic<bool>& cancel_;
};

/// Shows that rows are done. Throws Error{kCancelled} where `cancel` is set.
void report_rows(ProgressDisplay& display, const std::string& stage, std::int64_t done, std::int64_t rows,
                 const std::atomic<bool>& cancel);

}  // namespace isohf::cli
