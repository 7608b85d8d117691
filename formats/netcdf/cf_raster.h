#pragma once

#include "formats/netcdf/netcdf_file.h"
#include "isohf/raster.h"

namespace isohf {

/// How a variable's samples make a raster.
struct CfRaster {
  const NetcdfFile::Variable* variable = nullptr;
  bool by_columns = false;  ///< its last dimension goes along a column
  bool from_south = false;
  bool from_east = false;
};

/// The variable that options.channel names, or the likeliest to hold elevations, by the Climate and Forecast conventions
/// (CF): size, type, georeference, nodata, scale and unit into `info`. Throws Error naming info.path.
[[nodiscard]] CfRaster read_cf(const NetcdfFile& file, const OpenOptions& options, SourceInfo& info);

/// A variable's grid mapping, as something that names a reference system.
struct GridMapping {
  std::string name;    ///< "polar_stereographic"; empty: there is none
  std::string system;  ///< WKT, a code or a PROJ string; empty: none that is known here
};

/// metres_per_unit  of the coordinates
[[nodiscard]] GridMapping grid_mapping_of(const NetcdfFile& file, const NetcdfFile::Variable& variable,
                                          double metres_per_unit);

/// Where a unit of degrees points: 'e', 'w', 'n' or 's' ("degrees_east", "degree_N", "degreesW"), ' ' if it does not say;
/// '\0' for any other unit.
[[nodiscard]] char direction_of(std::string_view unit);

/// Whether a variable says where samples are, or how large they are.
[[nodiscard]] bool is_coordinate(const NetcdfFile& file, const NetcdfFile::Variable& variable);

/// The variable that holds the elevations. A loss if others may as well. Throws Error naming info.path.
[[nodiscard]] const NetcdfFile::Variable& elevations_of(const NetcdfFile& file, const OpenOptions& options,
                                                        SourceInfo& info);

}  // namespace isohf
