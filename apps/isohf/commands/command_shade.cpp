/// isohf shade: a picture of an archive's surface, with the shadows that it casts.

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <optional>

#include "commands/command.h"
#include "formats/write/raster_sink.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/shade.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/sun_options.h"
#include "options/work_options.h"
#include "output/output_kinds.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr std::int64_t kMaxPixels = 1 << 20;  ///< of a side
constexpr const char* kShadeFooter =
    R"(The picture covers what the input covered, North of its map at the top, and is transparent where there is no
elevation. Hillshades and shadow masks have one band: 1 to 255, and 0 for nodata. .tif has the georeference, .png gets
a world file next to it, .exr holds light, or shares from 0 to 1. Terrain beyond the input casts no shadows.
--kind hillshade is what gdaldem hillshade -compute_edges makes of the elevations at the centres of the pixels.
--date takes the sun over the archive's middle, on Earth or Mars. --time is mean solar time there.

Examples:
  isohf shade dem.isohf dem.png
  isohf shade dem.isohf evening.png --sun 250,5 --size 4096x2300
  isohf shade dem.isohf midsummer.png --date 2026-06-21 --time 9:00
  isohf shade dem.isohf shadows.tif --kind shadow-mask --sun 120,8)";

struct ShadeCommand {
  const Common& common;
  WorkOptions work{};
  std::string archive{};
  std::string output{};
  bool overwrite = false;
  bool no_shadow = false;
  std::optional<std::int64_t> longest{};  ///< pixels of the longer side
  SunPlace sun = kUsualSun;
  std::optional<SolarTime> date{};
  ShadeOptions picture{};
};

int run(ShadeCommand options) {
  const auto start = std::chrono::steady_clock::now();
  const Common& common = options.common;
  check_raster_output({options.archive}, options.output, options.overwrite);
  ArchiveReader archive = open_archive(options.archive);
  print_warnings(common, archive.warnings());
  const Metadata& metadata = archive.metadata();
  if (const auto& ground = metadata.source.ground;
      ground && !metadata.projection && ground->worst_error > MapGround::kTrueEnough) {
    constexpr double kMostOnOneMap_deg = 180.0;
    const bool is_wide = ground->extent.east - ground->extent.west > kMostOnOneMap_deg;
    print_warning(common,
                  fmt::format("{}: lengths on its map are {:.4g} times those on the ground, and slopes and "
                              "shadows are the map's. For true ones convert {} --to-crs auto",
                              options.archive, ground->mean_scale, is_wide ? "a part, with --bbox and" : "with"));
  }
  ShadeOptions& request = options.picture;
  const GridSize size = request.size.value_or(shade_size(archive, options.longest));
  request.size = size;
  request.floats = lower_case(std::filesystem::path(options.output).extension().string()) == ".exr";
  const SunPlace sun = sun_over(archive, options.date, options.sun);
  request.sun_azimuth_deg = sun.azimuth_deg;
  request.sun_elevation_deg = sun.elevation_deg;
  const ShadeSamples samples = shade_samples(request);

  RasterSpec spec;
  spec.width = size.first;
  spec.height = size.second;
  spec.sample_type = samples.type;
  spec.channels = samples.channels;
  spec.void_value = samples.void_value;
  spec.georeference = picture_georeference(metadata, size);
  spec.overwrite = options.overwrite;
  spec.scratch = scratch_of(options.work);
  check_raster_room(options.output, spec);
  const auto sink = create_raster(options.output, spec);
  ProgressDisplay display(common, options.work.progress);
  const ShadeReport shaded = shade_rows(
      archive, request, [&](std::span<const std::byte> rows) { sink->write_rows(rows); },
      job_from(options.work, display));
  display.clear();
  sink->finish();

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::int64_t tiles = metadata.plane_grid(shaded.plane).tile_count();
  Report report;
  report.add("archive", options.archive);
  report.add("output", options.output, "picture",
             fmt::format("{}: {} x {} pixels of {} tiles{} in {}", options.output, size.first, size.second,
                         describe_count(tiles), shaded.plane > 0 ? fmt::format(" of overview {}", shaded.plane) : "",
                         describe_seconds(seconds)));
  report.add("files_written", sink->files());
  report.add("width", size.first);
  report.add("height", size.second);
  report.add("plane", shaded.plane);
  report.add("tiles", tiles);
  report.add("seconds", seconds);
  if (options.date) {
    const double hours = options.date->hours;
    report.add("sun", {{"hours", hours}, {"azimuth_deg", sun.azimuth_deg}, {"elevation_deg", sun.elevation_deg}}, "sun",
               fmt::format("{:02}:{:02.0f} solar time, azimuth {:.2f}, {:.2f} degrees high", static_cast<int>(hours),
                           (hours - std::floor(hours)) * 60.0, sun.azimuth_deg, sun.elevation_deg));
  }
  report.print(common);
  return kExitDone;
}

}  // namespace

Run add_shade(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<ShadeCommand>(ShadeCommand{common});
  ShadeCommand& options = *kept;
  ShadeOptions& request = options.picture;
  positional(line, "ARCHIVE", "Archive to draw", options.archive);
  positional(line, "OUTPUT,-o,--output", "Picture to write: .png, .tif or .exr", options.output);
  line.add_flag("--overwrite", options.overwrite, "Replace OUTPUT if it exists");
  choice<ShadeKind>(
      line, "--kind",
      {{"relief", ShadeKind::kPicture}, {"hillshade", ShadeKind::kHillshade}, {"shadow-mask", ShadeKind::kShadowMask}},
      "Draw a coloured relief with cast shadows, Horn's hillshade in grey, or the visible share of the sun "
      "[default: relief]",
      request.kind);
  group(line, "Light");
  add_sun_options(line, options.sun, options.date, "300,35; for hillshades GDAL's 315,45");
  line.add_flag("--no-shadow", options.no_shadow, "Leave out cast shadows");
  group(line, "Picture");
  option(line, "--size", "N|WxH",
         "Make the longer side N pixels, or the picture W by H [default: one for each lattice step, at most 2048]",
         [&options, &request](const std::string& text) {
           const bool is_side = text.find_first_of("xX") == std::string::npos;
           options.longest = is_side ? std::optional(parse_whole_number(text, 1, kMaxPixels)) : std::nullopt;
           request.size = is_side ? std::nullopt : std::optional(parse_size(text, 1, kMaxPixels));
         });
  option(line, "--exaggeration", "F", "Draw heights F times as high [default: 1]",
         [&request](const std::string& text) { request.exaggeration = parse_positive_number(text); });
  line.add_flag("--texture", request.texture, "Show the archive's textures, and the palette where there are none");
  option(line, "--palette", "elevation|gray|mars", "Colour elevations by this palette [default: by the body]",
         [&request](const std::string& text) { request.palette = parse_palette(text); });
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
  most_used(line, {"--kind", "--sun", "--date", "--time", "--size", "--texture", "--overwrite"});
  line.footer(kShadeFooter);
  return [kept, &line] {
    ShadeOptions& picture = kept->picture;
    if (picture.kind != ShadeKind::kPicture) {
      for (const char* name : {"--no-shadow", "--texture", "--palette"}) {
        if (given(line, name)) throw Error(ErrorCode::kInvalidArgument, std::string(name) + " needs --kind relief");
      }
    }
    kept->work.scratch_folder = scratch_folder_for(kept->output);
    picture.shadows = !kept->no_shadow;
    if (!given(line, "--sun") && picture.kind == ShadeKind::kHillshade) kept->sun = {315.0, 45.0};
    return run(std::move(*kept));
  };
}

}  // namespace isohf::cli
