/// isohf shade: a picture of an archive's surface, with the shadows that it casts.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "formats/files/text.h"
#include "formats/write/raster_sink.h"
#include "isohf/error.h"
#include "isohf/shade.h"
#include "open_archive.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "options/quantities.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr std::int64_t kMaxPixels = 1 << 20;  ///< of a side
constexpr const char* kFooter =
    R"(The picture covers what the input covered, North at the top; where there is no elevation it is transparent.
North is the map's, as with GDAL. Shadows fall for a sun that stands anywhere; the ground beyond what the input covered casts
none. --hillshade, --multidirectional, --slope and --aspect are those of gdaldem, by Horn's formula: one band. Hillshades
and shadow masks hold 1 to 255, and 0 where there is no elevation; slopes and aspects hold degrees, and -9999.
.tif has the georeference, .png a world file beside it. .exr holds light, or shares from 0 to 1.
Memory is bounded whatever the archive's height: a row of its tiles twice, and about 64 MB.

Examples:
  isohf shade dem.isohf -o dem.png
  isohf shade dem.isohf -o evening.png --sun-elevation 5 --azimuth 250 --size 4096x2300
  isohf shade dem.isohf -o map.png --texture
  isohf shade dem.isohf -o hillshade.tif --hillshade
  isohf shade dem.isohf -o shadows.tif --shadow-mask --azimuth 120 --altitude 8)";

struct ShadeCommand {
  CommonOptions common;
  WorkOptions work;
  std::string archive;
  std::string output;
  bool overwrite = false;
  bool uncompressed = false;
  bool no_shadow = false;
  std::optional<std::int64_t> longest;  ///< pixels of the longer side
  bool no_relief = false;
  std::string palette;  ///< a file of colours
  std::optional<double> azimuth;
  std::optional<double> elevation;
  ShadeOptions picture;
};

struct Kind {
  const char* option;
  const char* help;
  ShadeKind kind;
};
constexpr Kind kKinds[] = {
    {"--hillshade", "Grey, by how slopes face the sun: one band, as gdaldem hillshade", ShadeKind::kHillshade},
    {"--multidirectional", "The same with light from four sides", ShadeKind::kMultidirectional},
    {"--slope", "Slopes in degrees", ShadeKind::kSlope},
    {"--aspect", "The directions that slopes face, in degrees clockwise from North", ShadeKind::kAspect},
    {"--shadow-mask", "The share of the sun that is seen", ShadeKind::kShadowMask},
};

/// The name of a file, where it is no palette's.
std::string parse_palette(const std::string& text, std::optional<ShadePalette>& palette) {
  constexpr ShadePalette kPalettes[] = {ShadePalette::kElevation, ShadePalette::kGray, ShadePalette::kMars};
  if (text.find_first_of("./") != std::string::npos) return text;
  palette = kPalettes[parse_word(text, {"elevation", "gray", "mars"})];
  return {};
}

std::optional<ShadeCommand> parse(const Arguments& arguments) {
  ShadeCommand options;
  ShadeOptions& request = options.picture;
  CommandLine line("shade", "Draws a picture of an archive's surface with the shadows that it casts.");
  line.group("Arguments");
  line.positional("ARCHIVE", "-i,--input", "Archive to draw", options.archive);
  line.positional("OUTPUT", "-o,--output", "Picture to write: .png, .tif or .exr", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  line.flag("--uncompressed", "TIFF, EXR: no compression", options.uncompressed);
  line.group("In place of a picture");
  bool asked = false;
  std::vector<std::string> kinds;
  for (const Kind& kind : kKinds) {
    kinds.emplace_back(kind.option);
    line.flag(kind.option, kind.help, asked, [&request, &kind] { request.kind = kind.kind; });
  }
  // What a kind has no use for.
  for (const char* option : {"--no-relief", "--no-shadow", "--texture", "--palette"}) {
    std::vector<std::string> rivals = kinds;
    rivals.emplace_back(option);
    line.exclusive(rivals);
  }
  for (const Kind& kind : kKinds) {
    if (kind.kind == ShadeKind::kShadowMask) continue;
    line.exclusive({kind.option, "--shadow-softness"});
    if (kind.kind != ShadeKind::kHillshade) line.exclusive({kind.option, "--azimuth"});
    if (kind.kind == ShadeKind::kSlope || kind.kind == ShadeKind::kAspect) {
      line.exclusive({kind.option, "--sun-elevation"});
    }
  }
  line.exclusive({"--no-shadow", "--shadow-softness"});
  line.group("Light");
  line.option("--azimuth", "DEG",
              "Where the sun stands, clockwise from North; N, E, S or W (default 270; --hillshade 315)",
              [&](const std::string& text) { options.azimuth = parse_azimuth(text); });
  line.option("--altitude,--sun-elevation", "DEG",
              "Height of the sun above the horizon, 0.01 to 90 (default 15; --hillshade, --multidirectional 45)",
              [&](const std::string& text) { options.elevation = parse_altitude(text); });
  line.flag("--no-relief", "Light all ground as if it were level", options.no_relief);
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
  line.option("--z-factor,--exaggeration", "F", "Draw heights F times as high (default 1)",
              [&](const std::string& text) { request.exaggeration = parse_positive_number(text); });
  line.flag("--texture", "Show the archive's textures; where there is none, the palette's colours", request.texture);
  line.option("--palette", "NAME|FILE",
              "Colours of the ground: elevation, gray, mars (default: its body's), or a text file of elevations and "
              "colours as for gdaldem color-relief",
              [&](const std::string& text) { options.palette = parse_palette(text, request.palette); });
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archive);
  line.require("OUTPUT", options.output);
  request.shadows = !options.no_shadow;
  request.relief = !options.no_relief;
  const bool as_gdal = request.kind == ShadeKind::kHillshade || request.kind == ShadeKind::kMultidirectional;
  request.sun_azimuth_deg = options.azimuth.value_or(as_gdal ? 315.0 : 270.0);
  request.sun_elevation_deg = options.elevation.value_or(as_gdal ? 45.0 : 15.0);
  return options;
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
  if (!options.palette.empty()) request.colours = read_colour_relief(options.palette, archive.metadata());
  request.elevation_units_per_world_unit = elevation_units_per_world_unit(archive.metadata());

  request.floats = lower_case(std::filesystem::path(options.output).extension().string()) == ".exr";
  const ShadeSamples samples = shade_samples(request);

  RasterSpec spec;
  spec.width = size.first;
  spec.height = size.second;
  spec.sample_type = samples.type;
  spec.channels = samples.channels;
  spec.void_value = samples.void_value;
  spec.compress = !options.uncompressed;
  spec.georeference = georeference_of(archive.metadata(), size);
  spec.overwrite = options.overwrite;
  const auto sink = create_raster(options.output, spec);

  ProgressDisplay display(options.work.progress, common.quiet, common.verbose);
  const ShadeReport report = shade_rows(
      archive, request, [&](std::span<const std::byte> rows) { sink->write_rows(rows); },
      job_from(options.work, display));
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
                         {"seconds", seconds}}));
  } else if (!common.quiet) {
    out.write(fmt::format("picture      {}: {} x {} pixels of {} tiles{} in {}\n", options.output, size.first,
                          size.second, describe_count(tiles),
                          report.plane > 0 ? fmt::format(" of coarse plane {}", report.plane) : "",
                          describe_seconds(seconds)));
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
