/// isohf extract: some tiles of an archive as one of their own.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "input/box_ground.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "open_archive.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "options/tile_range.h"
#include "output/output_kinds.h"
#include "output/part_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kExtractFooter =
    R"(The result is an archive like any other. Tiles and textures are copied as they are, and every place keeps its
elevation; coarse planes, shadow seeds and statistics are made from them. Residuals are left out. The tiles of a
coarse plane become an archive without textures and seeds.

Examples:
  isohf extract land.isohf -o valley.isohf --bbox 6.5,45,7,45.5
  isohf extract land.isohf -o north.isohf --tiles 0:40,0:12       columns 0 to 39, rows 0 to 11
  isohf extract land.isohf -o afar.isohf --plane 2                all of it, of every 64th vertex)";

struct ExtractCommand {
  CommonOptions common;
  WorkOptions work;
  std::string archive;
  std::string output;
  std::optional<BoundingBox> bbox;
  std::optional<TileRange> tiles;
  int plane = 0;
  bool overwrite = false;
};

std::optional<ExtractCommand> parse_extract(const Arguments& arguments) {
  ExtractCommand options;
  CommandLine line("extract", "Cuts an archive: some of its tiles become an archive of their own.");
  line.group("Arguments");
  line.positional("ARCHIVE", "Archive to cut", options.archive);
  line.option("-o,--output", "OUTPUT", "Archive to write", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  line.option("--bbox", "W,S,E,N", "All tiles that touch this rectangle, in the units of the source's reference system",
              [&](const std::string& text) { options.bbox = bounding_box_from_string(text); });
  line.option("--tiles", "A:B,C:D", "Columns A to B-1 and rows C to D-1 of tiles, counted from 0 in the North-West",
              [&](const std::string& text) { options.tiles = parse_tile_range(text); });
  line.option("--plane", "K",
              "Tiles of this coarse plane, from 1 on, all or those that --bbox or --tiles ask for of it",
              [&](const std::string& text) { options.plane = static_cast<int>(parse_whole_number(text, 1, 64)); });
  line.exclusive({"--bbox", "--tiles"});
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kExtractFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archive);
  line.require("OUTPUT (-o)", options.output);
  if (!options.bbox && !options.tiles && options.plane == 0) {
    throw Error(ErrorCode::kInvalidArgument, "extract: which tiles? Give --bbox W,S,E,N, --tiles A:B,C:D or --plane K");
  }
  return options;
}

}  // namespace

int command_extract(const Arguments& arguments) {
  const auto options = parse_extract(arguments);
  if (!options) return kExitDone;
  check_archive_output({options->archive}, options->output, options->overwrite);
  const TileRange tiles = options->tiles ? *options->tiles : [&] {
    ArchiveReader archive = open_archive(options->archive);
    const TileRange here = plane_tiles_of(archive, options->plane);
    if (!options->bbox) return here;
    const TileGrid grid = archive.metadata().plane_grid(options->plane);
    return tiles_touching(grid, ground_in_box(archive, *options->bbox, AcrossEnds::kRefused));
  }();
  return print_part(options->output, options->common, options->work, [&](const Job& job) {
    return extract_tiles(options->archive, options->output, options->plane, tiles,
                         {options->overwrite, options->common.strict}, job);
  });
}

}  // namespace isohf::cli
