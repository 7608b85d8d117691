#pragma once

#include <string>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "options/work_options.h"

namespace isohf::cli {

/// True where `isohf info` should take the file for an archive: a ZIP file that begins with our metadata, or that no
/// reader of rasters knows; or a file named .isohf that none knows. Throws Error{kIo, kCorrupt} as open_raster.
[[nodiscard]] bool is_archive(const std::string& path, const OpenOptions& options);

/// Prints what is understood of a raster; `with_statistics` reads all of it. JSON of one of many takes a line.
void print_raster_info(const std::string& path, const OpenOptions& options, bool with_statistics, const Common& common,
                       bool is_one_of_many);

}  // namespace isohf::cli
