#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/raster.h"

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

/// The commonest name of a world file beside a raster: raster.pgw beside raster.png.
[[nodiscard]] std::string world_file_name(const std::string& raster_path);

/// The text of raster.prj (or .PRJ) beside raster.tif; empty where none is. At most 64 KiB.
[[nodiscard]] std::string prj_beside(const std::string& raster_path);

/// The path of the file called `name`, in any case, in the folder of the file `beside`: labels were written for file
/// systems without case. Empty where there is none.
[[nodiscard]] std::string file_beside(const std::string& beside, const std::string& name);

/// Reads NAME.EXT.aux.xml, in which GDAL keeps what a raster's format has no room for ("Persistent Auxiliary
/// Metadata"): where the raster lies, its reference system, and for each band a void value, unit, scale and offset, and
/// that bytes have signs. `band` counts from 1; with 0 none of the latter is taken. Takes what `info` does not know yet
/// and leaves what it knows, with a note where the two differ; statistics and all else are passed over. No such file:
/// nothing happens. Throws Error naming the file: kCorrupt where it is not XML or its numbers are none, kUnsupported
/// where it turns the raster or puts South on top.
void read_auxiliary_metadata(SourceInfo& info, int band);

/// Gives `bands` bands the names that the same file has for those without one.
void name_bands_beside(const std::string& raster_path, std::size_t bands, std::vector<std::string>& names);

/// Reads the .prj beside info.path, where there is one. One that PROJ does not understand becomes a warning, and so do
/// coordinates that look like degrees without one.
void read_prj_beside(SourceInfo& info);

/// What lies beside a grid: the .prj, where the grid does not know its reference system, then read_auxiliary_metadata.
void read_files_beside(SourceInfo& info, int band);

/// Spacing and origin of a raster of `rows` rows; the origin is the northernmost row's, whichever the file has first.
void place_by(const WorldFile& world, std::int64_t rows, Georeference& place);

/// The same by GDAL's six numbers, "x0, dx, 0, y0, 0, -dy", of the outer corner of the first sample. Throws Error naming
/// `path`: kCorrupt, kUnsupported for a raster that is turned or has South on top.
void place_by_transform(const std::string& path, const std::string& text, Georeference& place);

/// Takes a reference system that `path` gives: WKT, a code, PROJJSON or a PROJ string. One that is none of a map or of
/// degrees, or that PROJ does not understand, is left out with a warning. Throws Error{kUnsupported} naming `path` for
/// one whose coordinates are counted in a way that isohf does not read.
void read_system_text(const std::string& text, const std::string& path, SourceInfo& info);

/// Whether the file has said what its coordinates are: a header may know metres without a name for their map.
[[nodiscard]] bool has_reference_system(const Georeference& place);

/// For pictures, which have nothing to say of their place: GDAL's .aux.xml beside, or else the world file, and the
/// .prj. `band` as read_auxiliary_metadata has it. Throws Error: kUnsupported where the world file has the southernmost
/// row first, and as world_file_beside and read_auxiliary_metadata do.
void read_place_beside(SourceInfo& info, int band);

}  // namespace isohf
