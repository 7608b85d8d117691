/// isohf shade: a picture of an archive's surface, with the shadows that it casts.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "formats/io/text.h"
#include "formats/write/raster_sink.h"
#include "input/quantities.h"
#include "isohf/error.h"
#include "isohf/shade.h"
#include "isohf/surface.h"
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
/// Heights of the sun that are drawn.
constexpr double kLowest_deg = 0.01;
constexpr double kHighest_deg = 89.9;
constexpr const char* kShadeFooter =
    R"(The picture covers what the input covered, North at the top; where there is no elevation it is transparent.
North is the map's, as with GDAL. Shadows fall for a sun that stands anywhere; the ground beyond what the input covered casts
none. Hillshades and shadow masks have one band: 1 to 255, and 0 where there is no elevation.
--hillshade is Horn's formula on the surface's elevations in the middle of the pixels: what gdaldem hillshade -compute_edges
makes of `isohf export --like OUTPUT --method barycentric`.
.tif has the georeference, .png a world file beside it. .exr holds light, or shares from 0 to 1.
--date asks for the sun over the archive's middle, on Earth or Mars, at --time: mean solar time there, which is noon where the
sun stands highest, but for a quarter of an hour.
Memory is bounded whatever the archive's height: a row of its tiles twice, and about 64 MB; or by --memory.

Examples:
  isohf shade dem.isohf -o dem.png
  isohf shade dem.isohf -o evening.png --sun-elevation 5 --azimuth 250 --size 4096x2300
  isohf shade dem.isohf -o midsummer.png --date 2026-06-21 --time 9:00
  isohf shade dem.isohf -o map.png --texture
  isohf shade dem.isohf -o hillshade.tif --hillshade
  isohf shade dem.isohf -o shadows.tif --shadow-mask --azimuth 120 --sun-elevation 8)";

struct ShadeCommand {
  CommonOptions common;
  WorkOptions work;
  std::string archive;
  std::string output;
  bool overwrite = false;
  bool no_shadow = false;
  std::optional<std::int64_t> longest;  ///< pixels of the longer side
  std::optional<double> azimuth;
  std::optional<double> elevation;
  std::optional<SolarTime> date;
  double time = 12.0;
  ShadeOptions picture;
};

struct Kind {
  const char* option;
  const char* help;
  ShadeKind kind;
};
constexpr Kind kKinds[] = {
    {"--hillshade", "Grey, by how slopes face the sun: Horn's formula on the elevations in the middle of pixels",
     ShadeKind::kHillshade},
    {"--shadow-mask", "The share of the sun that is seen", ShadeKind::kShadowMask},
};

std::optional<ShadeCommand> parse_shade(const Arguments& arguments) {
  ShadeCommand options;
  ShadeOptions& request = options.picture;
  CommandLine line("shade", "Draws a picture of an archive's surface with the shadows that it casts.");
  line.group("Arguments");
  line.positional("ARCHIVE", "Archive to draw", options.archive);
  line.positional("OUTPUT", "-o,--output", "Picture to write: .png, .tif or .exr", options.output);
  line.flag("--overwrite", "Replace OUTPUT where it exists", options.overwrite);
  line.group("In place of a picture");
  bool asked = false;
  std::vector<std::string> kinds;
  for (const Kind& kind : kKinds) {
    kinds.emplace_back(kind.option);
    line.flag(kind.option, kind.help, asked, [&request, &kind] { request.kind = kind.kind; });
  }
  // What a kind has no use for.
  for (const char* option : {"--no-shadow", "--texture", "--palette"}) {
    std::vector<std::string> rivals = kinds;
    rivals.emplace_back(option);
    line.exclusive(rivals);
  }
  line.group("Light");
  line.option("--azimuth", "DEG",
              "Where the sun stands, clockwise from North; N, E, S or W (default 270; --hillshade 315)",
              [&](const std::string& text) { options.azimuth = parse_azimuth(text); });
  line.option("--sun-elevation", "DEG", "Height of the sun above the horizon, 0.01 to 90 (default 15; --hillshade 45)",
              [&](const std::string& text) { options.elevation = parse_altitude(text); });
  line.option("--date", "YYYY-MM-DD", "The sun of that day over the archive's middle (Earth and Mars)",
              [&](const std::string& text) {
                const auto [year, month, day] = parse_date(text);
                options.date = {year, month, day};
              });
  line.option("--time", "HH:MM", "With --date: mean solar time there (default 12:00)",
              [&](const std::string& text) { options.time = parse_time(text); });
  for (const char* option : {"--azimuth", "--sun-elevation"}) line.exclusive({"--date", option});
  line.flag("--no-shadow", "Leave out the shadows that land casts on land beyond it", options.no_shadow);
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
  line.option("--palette", "NAME", "Colours of the ground: elevation, gray, mars (default: its body's)",
              [&](const std::string& text) { request.palette = parse_palette(text); });
  add_work_options(line, options.work);
  add_memory_option(line, options.work);
  add_common_options(line, options.common);
  line.footer(kShadeFooter);
  if (!line.parse(arguments)) return std::nullopt;
  line.require("ARCHIVE", options.archive);
  line.require("OUTPUT", options.output);
  options.work.scratch_folder = scratch_folder_for(options.output);
  if (line.given("--time") && !options.date) line.fail("--time needs --date");
  request.shadows = !options.no_shadow;
  const bool as_gdal = request.kind == ShadeKind::kHillshade;
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

/// Where the sun of --date stands at --time. Throws Error{kInvalidArgument} if it is below the horizon.
SunPlace sun_of_day(const ShadeCommand& options, ArchiveReader& archive) {
  try {
    understand_source(archive);
  } catch (const Error&) {
    // It may have degrees all the same; else DaySky says so.
  }
  SolarTime time = *options.date;
  time.hours = options.time;
  SunPlace sun = DaySky(archive).sun(time);
  if (sun.elevation_deg < kLowest_deg) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("--time: the sun stands {:.2g} degrees below the horizon then",
                                                         std::max(0.0, -sun.elevation_deg)));
  }
  sun.elevation_deg = std::min(sun.elevation_deg, kHighest_deg);
  return sun;
}

/// Heights without a unit, as fractions are, may be too small beside the ground for a slope to be seen.
void tell_flat_relief(const Metadata& metadata, const ShadeOptions& request) {
  constexpr double kFlat = 0.01;
  constexpr double kHilly = 0.2;
  const bool is_seen = request.kind != ShadeKind::kShadowMask;
  const WorldBounds& ground = metadata.valid;
  const double range = metadata.statistics.max.value_or(0.0) - metadata.statistics.min.value_or(0.0);
  const double share = range / std::min(ground.x1 - ground.x0, ground.z1 - ground.z0);
  const bool is_to_scale = metadata.horizontal_unit != "unknown";
  if (!is_seen || is_to_scale || request.exaggeration != 1.0 || !(share > 0.0) || share > kFlat) return;
  print_note(
      fmt::format("elevations span {:.2g} of the ground's width in numbers without a unit, so that no slope is seen; "
                  "--exaggeration {:.0f} shows them",
                  share, std::pow(10.0, std::round(std::log10(kHilly / share)))));
}

int run(ShadeCommand options) {
  const auto start = std::chrono::steady_clock::now();
  const CommonOptions& common = options.common;
  check_raster_output({options.archive}, options.output, options.overwrite);
  ArchiveReader archive = open_archive(options.archive);
  print_warnings(archive.warnings());
  const Metadata& metadata = archive.metadata();
  if (const auto& ground = metadata.source.ground;
      ground && !metadata.projection && ground->worst_error > MapGround::kTrueEnough) {
    print_warning(
        fmt::format("{}: lengths on its map are {:.4g} times those on the ground, and slopes and shadows are "
                    "of the map; `convert --to-crs auto` makes an archive that is true",
                    options.archive, ground->mean_scale));
  }
  ShadeOptions& request = options.picture;
  if (!common.quiet) tell_flat_relief(metadata, request);
  const GridSize size = request.size.value_or(shade_size(archive, options.longest));
  request.size = size;
  request.floats = lower_case(std::filesystem::path(options.output).extension().string()) == ".exr";
  const ShadeSamples samples = shade_samples(request);

  RasterSpec spec;
  spec.width = size.first;
  spec.height = size.second;
  spec.sample_type = samples.type;
  spec.channels = samples.channels;
  spec.void_value = samples.void_value;
  spec.georeference = georeference_of(archive.metadata(), size);
  spec.overwrite = options.overwrite;
  spec.scratch = scratch_of(options.work);

  if (options.date) {
    const SunPlace sun = sun_of_day(options, archive);
    request.sun_azimuth_deg = sun.azimuth_deg;
    request.sun_elevation_deg = sun.elevation_deg;
  }
  check_raster_room(options.output, spec);
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
    ordered_json document{{"archive", options.archive},
                          {"output", options.output},
                          {"files_written", sink->files()},
                          {"width", size.first},
                          {"height", size.second},
                          {"plane", report.plane},
                          {"tiles", tiles},
                          {"seconds", seconds}};
    if (options.date) {
      document["sun"] = {{"hours", options.time},
                         {"azimuth_deg", request.sun_azimuth_deg},
                         {"elevation_deg", request.sun_elevation_deg}};
    }
    out.write(json_text(document));
  } else if (!common.quiet) {
    std::string text;
    if (options.date) {
      text = fmt::format("sun          {:02}:{:02.0f} solar time, azimuth {:.2f}, {:.2f} degrees high\n",
                         static_cast<int>(options.time), (options.time - std::floor(options.time)) * 60.0,
                         request.sun_azimuth_deg, request.sun_elevation_deg);
    }
    out.write(text + fmt::format("picture      {}: {} x {} pixels of {} tiles{} in {}\n", options.output, size.first,
                                 size.second, describe_count(tiles),
                                 report.plane > 0 ? fmt::format(" of coarse plane {}", report.plane) : "",
                                 describe_seconds(seconds)));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_shade(const Arguments& arguments) {
  std::optional<ShadeCommand> options = parse_shade(arguments);
  return options ? run(std::move(*options)) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
