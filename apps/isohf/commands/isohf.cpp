/// The commands of isohf.

#include "commands/command.h"

namespace isohf::cli {
namespace {

constexpr const char* kMake = "Make and check archives";
constexpr const char* kUse = "Use them";
constexpr const char* kEdit = "Edit them";
constexpr const char* kOther = "Other";

constexpr Command kCommands[] = {
    {"plan", "Preview a conversion, or list tile shapes", kMake, add_plan},
    {"convert", "Make an archive from one or more rasters", kMake, add_convert},
    {"info", "Describe rasters and archives", kMake, add_info},
    {"verify", "Check archives, or measure one against its source", kMake, add_verify},
    {"view", "Explore an archive or raster in 3D, or render it to a PNG", kUse, nullptr, "isohf-view"},
    {"sample", "Print elevation and normal at given points", kUse, add_sample},
    {"shade", "Render a map: relief with cast shadows, or a hillshade", kUse, add_shade},
    {"export", "Write a raster, on the source's grid or any other", kUse, add_export},
    {"extract", "Copy some tiles into a new archive", kEdit, add_extract},
    {"merge", "Join the shards of a cluster job", kEdit, add_merge},
    {"diff", "Compare two archives", kEdit, add_diff},
    {"formats", "List the formats that isohf reads and writes", kOther, add_formats},
};

constexpr const char* kIsohfFooter = R"(Results go to standard output, everything else to standard error.

Exit status: 0 success, 1 failure, 2 wrong usage, 3 differences found (verify, diff), 130 interrupted.

Environment: ISOHF_MODULE_PATH is the folder of the module for OpenImageIO and of isohf-netcdf-probe [default: beside the
program, then ../lib/isohf]. ISOHF_SIMD=off disables vector code, without changing results. NO_COLOR turns colours off,
CLICOLOR_FORCE=1 keeps them in pipes.

Examples:
  isohf info dem.tif                        What is in this file?
  isohf plan dem.tif                        What would convert make of it?
  isohf convert dem.tif dem.isohf
  isohf verify dem.isohf --against dem.tif  How far off is the result?
  isohf view dem.isohf
  isohf export dem.isohf back.tif
  echo "1200.5 340" | isohf sample dem.isohf)";

}  // namespace

const Program kIsohf = {"isohf", "isohf turns elevation rasters into tiled terrain archives, and works with them.",
                        kIsohfFooter, kCommands};

}  // namespace isohf::cli
