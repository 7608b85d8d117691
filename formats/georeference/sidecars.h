#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// Takes from the files beside a raster what it does not say itself, whichever reader it has. In this order:
/// 1. NAME.EXT.aux.xml, GDAL's "Persistent Auxiliary Metadata": place, reference system, registration; and of the band
///    `band`, from 1 on (0: of none), nodata, unit, scale and offset, and that bytes have signs. What it says otherwise
///    than the raster is passed over with a note.
/// 2. The world file: spacing and origin.
/// 3. The .prj: the reference system, as a code, PROJ string, WKT or PROJJSON.
/// Coordinates that look like degrees become a warning where nothing says so.
///
/// Returns whether a world file has the southernmost row first, which is refused unless `may_turn`.
/// Throws Error naming the file: kCorrupt where it is not what its name says, kUnsupported where it turns the raster, or
/// counts its coordinates in a way that isohf does not read.
bool read_sidecars(SourceInfo& info, int band, bool may_turn = false);

/// Gives `bands` bands the names that NAME.EXT.aux.xml has for those without one.
void name_bands_beside(const std::string& raster_path, std::size_t bands, std::vector<std::string>& names);

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

/// Spacing and origin of a raster of `rows` rows; the origin is the northernmost row's, whichever the file has first.
void place_by(const WorldFile& world, std::int64_t rows, Georeference& place);

/// The same by GDAL's six numbers, "x0, dx, 0, y0, 0, -dy", of the outer corner of the first sample. Throws Error naming
/// `path`: kCorrupt, kUnsupported for a raster that is turned or has South on top.
void place_by_transform(const std::string& path, const std::string& text, Georeference& place);

/// The text of raster.prj (or .PRJ) beside raster.tif; empty where none is. At most 64 KiB.
[[nodiscard]] std::string prj_beside(const std::string& raster_path);

/// The path of the file called `name`, in any case, in the folder of the file `beside`: labels were written for file
/// systems without case. Empty where there is none.
[[nodiscard]] std::string file_beside(const std::string& beside, const std::string& name);

/// Takes a reference system that `path` gives: WKT, a code, PROJJSON or a PROJ string. One that is none of a map or of
/// degrees, or that PROJ does not understand, is left out with a warning. Throws Error{kUnsupported} naming `path` for
/// one whose coordinates are counted in a way that isohf does not read.
void read_system_text(const std::string& text, const std::string& path, SourceInfo& info);

/// Whether the file has said what its coordinates are: a header may know metres without a name for their map.
[[nodiscard]] bool has_reference_system(const Georeference& place);

}  // namespace isohf
