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
#include "isohf/error.h"
#include "isohf/shade.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/sun_options.h"
#include "options/work_options.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr std::int64_t kMaxPixels = 1 << 20;  ///< of a side
constexpr const char* kShadeFooter =
    R"(The picture covers what the input covered, North at the top; where there is no elevation it is transparent.
North is the map's, as with GDAL. Shadows fall for a sun that stands anywhere; the ground beyond what the input covered casts
none. Hillshades and shadow masks have one band: 1 to 255, and 0 where there is no elevation.
--kind hillshade is Horn's formula on the surface's elevations in the middle of the pixels: what gdaldem hillshade -compute_edges
makes of `isohf export --like OUTPUT --method barycentric`.
.tif has the georeference, .png a world file beside it. .exr holds light, or shares from 0 to 1.
--date asks for the sun over the archive's middle, on Earth or Mars, at --time: mean solar time there, which is noon where the
sun stands highest, but for a quarter of an hour.
Memory is bounded whatever the archive's height: a row of its tiles twice, and about 64 MB; or by --memory.

Examples:
  isohf shade dem.isohf -o dem.png
  isohf shade dem.isohf -o evening.png --sun 250,5 --size 4096x2300
  isohf shade dem.isohf -o midsummer.png --date 2026-06-21 --time 9:00
  isohf shade dem.isohf -o map.png --texture
  isohf shade dem.isohf -o hillshade.tif --kind hillshade
  isohf shade dem.isohf -o shadows.tif --kind shadow-mask --sun 120,8)";

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

/// Heights without a unit, as fractions are, may be too small beside the ground for a slope to be seen.
void note_flat_relief(const Common& common, const Metadata& metadata, const ShadeOptions& request) {
  constexpr double kFlat = 0.01;
  constexpr double kHilly = 0.2;
  const bool is_seen = request.kind != ShadeKind::kShadowMask;
  const WorldBounds& ground = metadata.valid;
  const double range = metadata.statistics.max.value_or(0.0) - metadata.statistics.min.value_or(0.0);
  const double share = range / std::min(ground.x1 - ground.x0, ground.z1 - ground.z0);
  const bool is_to_scale = metadata.horizontal_unit != "unknown";
  if (!is_seen || is_to_scale || request.exaggeration != 1.0 || !(share > 0.0) || share > kFlat) return;
  print_note(
      common,
      fmt::format("elevations span {:.2g} of the ground's width in numbers without a unit, so that no slope is seen; "
                  "--exaggeration {:.0f} shows them",
                  share, std::pow(10.0, std::round(std::log10(kHilly / share)))));
}

int run(ShadeCommand options) {
  const auto start = std::chrono::steady_clock::now();
  const Common& common = options.common;
  check_raster_output({options.archive}, options.output, options.overwrite);
  ArchiveReader archive = open_archive(options.archive);
  print_warnings(common, archive.warnings());
  const Metadata& metadata = archive.metadata();
  if (const auto& ground = metadata.source.ground;
      ground && !metadata.projection && ground->worst_error > MapGround::kTrueEnough) {
    print_warning(common,
                  fmt::format("{}: lengths on its map are {:.4g} times those on the ground, and slopes and shadows are "
                              "of the map; `convert --to-crs auto` makes an archive that is true",
                              options.archive, ground->mean_scale));
  }
  ShadeOptions& request = options.picture;
  if (!common.quiet) note_flat_relief(common, metadata, request);
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

  const SunPlace sun = options.date ? sun_of_day(archive, *options.date) : options.sun;
  request.sun_azimuth_deg = sun.azimuth_deg;
  request.sun_elevation_deg = sun.elevation_deg;
  check_raster_room(options.output, spec);
  const auto sink = create_raster(options.output, spec);
  ProgressDisplay display(options.common, options.work.progress);
  const ShadeReport report = shade_rows(
      archive, request, [&](std::span<const std::byte> rows) { sink->write_rows(rows); },
      job_from(options.work, display));
  display.clear();
  sink->finish();

  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const std::int64_t tiles = archive.metadata().plane_grid(report.plane).tile_count();
  StandardOutput out(common);
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
      document["sun"] = {{"hours", options.date->hours},
                         {"azimuth_deg", request.sun_azimuth_deg},
                         {"elevation_deg", request.sun_elevation_deg}};
    }
    out.write(json_text(document));
  } else if (!common.quiet) {
    std::string text;
    if (options.date) {
      text = fmt::format("sun          {:02}:{:02.0f} solar time, azimuth {:.2f}, {:.2f} degrees high\n",
                         static_cast<int>(options.date->hours),
                         (options.date->hours - std::floor(options.date->hours)) * 60.0, request.sun_azimuth_deg,
                         request.sun_elevation_deg);
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
      "Coloured relief with cast shadows, Horn's hillshade in grey, or the visible share of the sun "
      "[default: relief]",
      request.kind);
  group(line, "Light");
  add_sun_options(line, options.sun, options.date, "300,35; for hillshades GDAL's 315,45");
  line.add_flag("--no-shadow", options.no_shadow, "Leave out cast shadows");
  group(line, "Picture");
  option(line, "--size", "N|WxH",
         "Pixels, of the longer side or both [default: one for each lattice step, at most 2048]",
         [&options, &request](const std::string& text) {
           const bool is_side = text.find_first_of("xX") == std::string::npos;
           options.longest = is_side ? std::optional(parse_whole_number(text, 1, kMaxPixels)) : std::nullopt;
           request.size = is_side ? std::nullopt : std::optional(parse_size(text, 1, kMaxPixels));
         });
  option(line, "--exaggeration", "F", "Draw heights F times as high [default: 1]",
         [&request](const std::string& text) { request.exaggeration = parse_positive_number(text); });
  line.add_flag("--texture", request.texture, "Show the archive's textures; the palette shows where there is none");
  option(line, "--palette", "elevation|gray|mars", "Colours of elevations [default: those of its body]",
         [&request](const std::string& text) { request.palette = parse_palette(text); });
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
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
