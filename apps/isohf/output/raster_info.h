#pragma once

#include <optional>
#include <string>

#include "formats/registry.h"
#include "isohf/job.h"
#include "isohf/raster.h"
#include "isohf/restore/place/source_place.h"
#include "output/report.h"

namespace isohf::cli {

/// True if `isohf info` treats the file as an archive: a ZIP file that begins with our metadata, or that no reader of
/// rasters knows; or a file named .isohf that none knows. Throws Error{kIo, kCorrupt} as open_raster.
[[nodiscard]] bool is_archive(const std::string& path, const OpenOptions& options);

/// Warnings of a raster, each naming it, and what is understood of it.
struct RasterInfo {
  std::vector<Warning> warnings;
  Report report;
};
/// statistics  reads all samples, as this job
[[nodiscard]] RasterInfo describe_raster(const std::string& path, const OpenOptions& options, const Job* statistics);

/// Members bounds, centre, lonlat and map_scale (null if not known), and their lines.
void add_place(const std::optional<SourcePlace>& place, Report& report);

/// "WGS 84 / UTM zone 32N, EPSG:32632, heights above EGM96".
[[nodiscard]] std::string describe_reference(const ReferenceSystem& system);

}  // namespace isohf::cli
