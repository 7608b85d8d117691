/// isohf shade: a picture of an archive's surface, with the shadows that it casts.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "formats/georeference/units.h"
#include "formats/write/raster_sink.h"
#include "interrupt.h"
#include "isohf/error.h"
#include "isohf/shade.h"
#include "open_archive.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr std::int64_t kMaxPixels = 1 << 20;  ///< of a side
constexpr const char* kFooter =
    R"(The picture covers what the input covered, North at the top; where there is no elevation it is transparent.
Shadows are those of a sun due West or due East. Shadow seeds in the archive (convert --shadow-seeds) are used
where they hold for the sun asked for; the picture is the same without them.
Memory is bounded whatever the archive's and the picture's size: a few dozen tiles and about 64 MB.

Examples:
  isohf shade dem.isohf -o dem.png --hillshade
  isohf shade dem.isohf -o evening.png --hillshade --sun-elevation 5 --azimuth W --size 4096x2300
  isohf shade dem.isohf -o map.png --hillshade --texture
  isohf shade dem.isohf -o shadows.tif --palette gray --sun-elevation 8)";

struct ShadeCommand {
  CommonOptions common;
  WorkOptions work;
  std::string archive;
  std::string output;
  bool overwrite = false;
  bool no_shadow = false;
  std::optional<std::int64_t> longest;  ///< pixels of the longer side
  ShadeOptions picture;
};

double parse_sun(const std::string& text) {
  const double degrees = parse_number(text);
  if (!(degrees >= 0.01 && degrees < 90.0)) {
    throw Error(ErrorCode::kInvalidArgument, "found '" + text + "', must be degrees from 0.01 to below 90");
  }
  return degrees;
}

std::optional<ShadeCommand> parse(const Arguments& arguments) {
  ShadeCommand options;
  ShadeOptions& request = options.picture;
  CommandLine line("shade", "Draws a picture of an archive's surface with the shadows that it casts.");
  line.group("Arguments");
  line.positional("ARCHIVE", "-i,--input", "Archive to draw", options.archive);
  line.positional("OUTPUT", "-o,--output", "Picture to write, .png or .tif", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  line.group("Light");
  line.option("--sun-elevation", "DEG", "Height of the sun above the horizon, 0.01 to below 90 (default 15)",
              [&](const std::string& text) { request.sun_elevation_deg = parse_sun(text); });
  line.option("--azimuth", "E|W", "Put the sun in the East or the West (default W)", [&](const std::string& text) {
    request.sun = parse_word(text, {"E", "W"}) == 0 ? SunSide::kEast : SunSide::kWest;
  });
  line.flag("--hillshade", "Shade slopes by how they face the sun", request.hillshade);
  line.flag("--no-shadow", "Leave out the shadows that land casts on land beyond it", options.no_shadow);
  line.option("--shadow-softness", "K",
              "The sun's apparent size at the caster's distance, vertical units (default 2, or 0.5 % of the elevation "
              "range where that is less)",
              [&](const std::string& text) { request.softness = parse_positive_number(text); });
  line.group("Picture");
  line.option("--size", "N|WxH",
              "Pixels, of the longer side or both (default: one for each lattice step, at most 2048)",
              [&](const std::string& text) {
                const bool is_side = text.find_first_of("xX") == std::string::npos;
                options.longest = is_side ? std::optional(parse_whole_number(text, 1, kMaxPixels)) : std::nullopt;
                request.size = is_side ? std::nullopt : std::optional(parse_size(text, 1, kMaxPixels));
              });
  line.option("--exaggeration", "F", "Draw heights F times as high (default 1)",
              [&](const std::string& text) { request.exaggeration = parse_positive_number(text); });
  line.flag("--texture", "Show the archive's textures; where there is none, the palette's colours", request.texture);
  line.option(
      "--palette", "NAME", "Colours of the ground: elevation or gray (default elevation)",
      [&](const std::string& text) {
        request.palette = parse_word(text, {"elevation", "gray"}) == 0 ? ShadePalette::kElevation : ShadePalette::kGray;
      });
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archive);
  line.require("OUTPUT", options.output);
  if (options.no_shadow && request.softness) {
    throw Error(ErrorCode::kInvalidArgument, "shade: --shadow-softness and --no-shadow exclude each other");
  }
  request.shadows = !options.no_shadow;
  return options;
}

/// 1 where either unit is not known.
double elevation_units_per_world_unit(const Metadata& metadata) {
  if (metadata.horizontal_unit != "metre") return 1.0;
  const auto unit = linear_unit(metadata.vertical_unit);
  return unit ? 1.0 / unit->metres : 1.0;
}

/// Where the picture lies, for GeoTIFF; nullopt where the source did not say.
std::optional<Georeference> georeference_of(const Metadata& metadata, const GridSize& size) {
  const SourceRecord& source = metadata.source;
  if (!source.origin_x || !source.origin_y || !(source.crs_spacing_x > 0.0) || !(source.crs_spacing_y > 0.0)) {
    return std::nullopt;
  }
  auto found = grid_georeference(metadata, grid_over(metadata.valid, true, size, {}));
  found->registration = Registration::kArea;
  if (is_warped(metadata)) return found;
  found->system.vertical_datum.clear();
  found->system.vertical_epsg.reset();
  return found;
}

int run(ShadeCommand options) {
  const auto start = std::chrono::steady_clock::now();
  const CommonOptions& common = options.common;
  check_raster_output({options.archive}, options.output, options.overwrite);
  const ArchiveReader archive = open_archive(options.archive);
  print_warnings(archive.warnings());
  ShadeOptions& request = options.picture;
  const GridSize size = request.size.value_or(shade_size(archive, options.longest));
  request.size = size;
  request.elevation_units_per_world_unit = elevation_units_per_world_unit(archive.metadata());

  RasterSpec spec;
  spec.width = size.first;
  spec.height = size.second;
  spec.sample_type = SampleType::kUint8;
  spec.channels = static_cast<int>(kShadeChannels);
  spec.georeference = georeference_of(archive.metadata(), size);
  spec.overwrite = options.overwrite;
  const auto sink = create_raster(options.output, spec);

  ProgressDisplay display(options.work.progress, common.quiet, common.verbose);
  Job job;
  job.threads = options.work.threads;
  job.cancel = &watch_interrupts();
  job.progress = [&](const Progress& at) { display.update(at.stage, at.unit, at.done, at.total); };
  const ShadeReport report = shade_rows(
      archive, request, [&](std::span<const std::uint8_t> rows) { sink->write_rows(std::as_bytes(rows)); }, job);
  display.clear();
  sink->finish();

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::int64_t tiles = archive.metadata().plane_grid(report.plane).tile_count();
  StandardOutput out;
  if (common.json) {
    out.write(json_text({{"archive", options.archive},
                         {"output", options.output},
                         {"files_written", sink->files()},
                         {"width", size.first},
                         {"height", size.second},
                         {"plane", report.plane},
                         {"tiles", tiles},
                         {"used_shadow_seeds", report.used_seeds},
                         {"seconds", seconds}}));
  } else if (!common.quiet) {
    out.write(fmt::format("picture      {}: {} x {} pixels of {} tiles{} in {}{}\n", options.output, size.first,
                          size.second, describe_count(tiles),
                          report.plane > 0 ? fmt::format(" of coarse plane {}", report.plane) : "",
                          describe_seconds(seconds), report.used_seeds ? ", with the archive's shadow seeds" : ""));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_shade(const Arguments& arguments) {
  std::optional<ShadeCommand> options = parse(arguments);
  return options ? run(std::move(*options)) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
