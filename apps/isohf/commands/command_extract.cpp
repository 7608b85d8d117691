/// isohf extract: cuts tiles out of an archive.

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "input/box_ground.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/option_values.h"
#include "options/work_options.h"
#include "output/output_kinds.h"
#include "output/part_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kExtractFooter =
    R"(OUTPUT is an archive like any other. Tiles and textures are copied; overviews, shadow seeds and statistics are
made from them. Residuals of --lossless are left out. An extract of an overview has no textures and seeds.

Examples:
  isohf extract land.isohf valley.isohf --bbox 6.5,45,7,45.5
  isohf extract land.isohf north.isohf --tiles 0:40,0:12      columns 0 to 39, rows 0 to 11
  isohf extract land.isohf small.isohf --overview 2           all of it, every 64th vertex)";

struct ExtractCommand {
  const Common& common;
  WorkOptions work{};
  std::string archive{};
  std::string output{};
  std::optional<BoundingBox> bbox{};
  std::optional<TileRange> tiles{};
  int overview = 0;
  bool overwrite = false;
};

int run(const ExtractCommand& options) {
  check_archive_output({options.archive}, options.output, options.overwrite);
  ArchiveReader archive = open_archive(options.archive);
  TileRange tiles = plane_tiles_of(archive, options.overview);
  if (options.tiles) tiles = *options.tiles;
  if (options.bbox) {
    const TileGrid grid = archive.metadata().plane_grid(options.overview);
    tiles = tiles_touching(grid, ground_in_box(archive, *options.bbox, AcrossEnds::kRefused));
  }
  return print_part(options.output, options.common, options.work, [&](const Job& job) {
    return extract_tiles(options.archive, options.output, options.overview, tiles,
                         {options.overwrite, options.common.strict}, job);
  });
}

}  // namespace

Run add_extract(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<ExtractCommand>(ExtractCommand{common});
  ExtractCommand& options = *kept;
  positional(line, "ARCHIVE", "Archive to cut", options.archive);
  positional(line, "OUTPUT,-o,--output", "Archive to write", options.output);
  line.add_flag("--overwrite", options.overwrite, "Replace OUTPUT if it exists");
  group(line, "Tiles (at least one)");
  option(line, "--bbox", "W,S,E,N", "Take tiles that touch this rectangle, in the source's coordinates",
         [&options](const std::string& text) { options.bbox = bounding_box_from_string(text); });
  option(line, "--tiles", "A:B,C:D", "Take columns A to B-1 and rows C to D-1 of tiles, from 0 in the North-West",
         [&options](const std::string& text) { options.tiles = parse_tile_range(text); });
  option(line, "--overview", "K", "Take tiles of overview K, from 1 on: all, or those of --bbox or --tiles",
         [&options](const std::string& text) { options.overview = static_cast<int>(parse_whole_number(text, 1, 64)); });
  exclusive(line, {"--bbox", "--tiles"});
  add_work_options(line, options.work, common);
  line.footer(kExtractFooter);
  return [kept] {
    if (!kept->bbox && !kept->tiles && kept->overview == 0) {
      throw Error(ErrorCode::kInvalidArgument, "no tiles chosen. Use --bbox W,S,E,N, --tiles A:B,C:D or --overview K");
    }
    return run(*kept);
  };
}

}  // namespace isohf::cli
