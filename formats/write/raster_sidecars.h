#pragma once

#include <string>
#include <vector>

#include "formats/write/raster_sink.h"

namespace isohf {

/// A text file that belongs to a raster.
struct Sidecar {
  std::string path;
  std::string text;
};

/// The files that stand beside a raster of that name and spec: .hdr for GridFloat, .json (NAME.r16.json) for raw
/// samples and, where spec.describe says so, PNG, and .prj for grids whose reference system has a WKT.
[[nodiscard]] std::vector<Sidecar> sidecars_of(const std::string& path, const RasterSpec& spec);

/// The names of all that may stand beside a raster of that name.
[[nodiscard]] std::vector<std::string> sidecar_paths(const std::string& path);

/// Throws Error{kInvalidArgument} without the path where another kind of file would be replaced: a Radiance picture or
/// an ENVI header for .hdr, somebody else's .json.
void check_sidecar_target(const std::string& path);

/// The lines in front of an ESRI ASCII grid's numbers.
[[nodiscard]] std::string ascii_grid_header(const RasterSpec& spec);

/// The void value of an ASCII grid or GridFloat: the spec's own, or the lowest float, as which NaN is written.
[[nodiscard]] double grid_void(const RasterSpec& spec);

}  // namespace isohf
