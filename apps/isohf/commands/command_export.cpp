/// isohf export: the surface of an archive as an ortho raster of any grid, whole or cut into tiles.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "commands/export_tiles.h"
#include "formats/decorate/cropped_source.h"
#include "isohf/base/file.h"
#include "isohf/error.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/box_ground.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "options/options_raster.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"
#include "raster/restored_raster.h"
#include "work_arena.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kExportFooter =
    R"(Without options the samples lie where the source's lay. The format follows from OUTPUT's extension; .tif,
.exr, .flt, .asc, .r32 and .npy take elevations as float32, .hgt as int16, .png, .r16 and .raw as uint16
over the range of elevations that there is, with scale and offset in OUTPUT.json. Many tiles share one scale.
With --tile-size or --tiles OUTPUT is cut: NAME_x0_y0.r16 is the North-West tile, x counts East, y South.
Where the size is left open it becomes the nearest one that makes whole tiles.

Examples:
  isohf export dem.isohf dem.tif --spacing 30
  isohf export dem.isohf alps.png --size 4097x4097
  isohf export dem.isohf part.tif --bbox 6.5,45,7,45.5
  isohf export dem.isohf unreal.r16 --tile-size 1009 --overlap 1
  isohf export dem.isohf unity.raw --tiles 4x4 --tile-size 513 --overlap 1)";

struct ExportOptions {
  CommonOptions common;
  WorkOptions work;
  RasterOptions raster;
  std::optional<BoundingBox> bbox;
  std::optional<std::pair<double, double>> z_range;
  std::optional<double> z_scale;
  std::optional<double> z_offset;
  std::optional<GridSize> tiles;
  std::optional<GridSize> tile_size;
  std::int64_t overlap = 0;

  [[nodiscard]] RestoreMethod method(const Metadata& metadata, const SampleGrid& grid) const {
    return raster.method.value_or(usual_method(metadata, grid));
  }
};

/// "1009" is a square.
GridSize parse_side_or_size(const std::string& text) {
  if (text.find_first_of("xX") != std::string::npos) return parse_size(text, 1, kMostSide);
  const std::int64_t side = parse_whole_number(text, 1, kMostSide);
  return {side, side};
}

std::optional<ExportOptions> parse_export(const Arguments& arguments) {
  ExportOptions options;
  CommandLine line("export", "Writes the surface of an archive as a raster of elevations.");
  add_raster_arguments(line, "OUTPUT", options.raster);
  line.group("Grid");
  add_size_options(line, "Write so many samples over the ground (default: the source's samples)", options.raster);
  line.option("--bbox", "W,S,E,N",
              "Only this part of the ground, in the source's coordinates; across the 180th meridian W is above E",
              [&](const std::string& text) { options.bbox = bounding_box_from_string(text); });
  add_method_option(line, "hex", options.raster);
  line.group("Tiles");
  line.option("--tile-size", "N|WxH", "Cut into tiles of so many samples, each into a file of its own",
              [&](const std::string& text) { options.tile_size = parse_side_or_size(text); });
  line.option("--tiles", "NxM", "Cut into so many tiles across and down",
              [&](const std::string& text) { options.tiles = parse_size(text, 1, 65536); });
  line.option("--overlap", "K", "Samples that neighbouring tiles share (default 0; 1 for shared edges)",
              [&](const std::string& text) { options.overlap = parse_whole_number(text, 0, 65536); });
  line.group("Samples");
  add_type_option(line, "by the format", options.raster);
  line.option("--z-range", "MIN:MAX",
              "Elevations of the lowest and highest sample of an integer type (default of u8 and "
              "u16: those that there are, which takes another pass)",
              [&](const std::string& text) { options.z_range = parse_range(text); });
  line.option("--z-scale", "FACTOR", "elevation = sample * FACTOR + z-offset (default 1)",
              [&](const std::string& text) { options.z_scale = parse_positive_number(text); });
  line.option("--z-offset", "NUMBER", "See --z-scale (default 0)",
              [&](const std::string& text) { options.z_offset = parse_number(text); });
  add_clamp_option(line, "the type", options.raster);
  add_work_options(line, options.work);
  add_memory_options(line, "OUTPUT's folder", options.work);
  add_common_options(line, options.common);
  line.footer(kExportFooter);
  line.exclusive({"--z-range", "--z-scale"});
  line.exclusive({"--z-range", "--z-offset"});
  if (!line.parse(arguments)) return std::nullopt;
  require_raster_arguments(line, "OUTPUT", options.raster);
  if (options.work.scratch_folder.empty()) options.work.scratch_folder = folder_of(options.raster.output);
  if (options.overlap > 0 && !options.tiles && !options.tile_size) {
    throw Error(ErrorCode::kInvalidArgument, "export: --overlap needs --tiles or --tile-size");
  }
  return options;
}

struct ExportGrid {
  SampleGrid samples;
  TileCut cut;
};

ExportGrid asked_grid(const ExportOptions& options, ArchiveReader& archive) {
  const Metadata& metadata = archive.metadata();
  const WorldBounds ground = options.bbox ? ground_in_box(archive, *options.bbox, AcrossEnds::kGoesOn) : metadata.valid;
  const bool area = samples_are_areas(metadata);
  const auto& asked = options.bbox;
  const auto box =
      asked ? std::optional(MapBounds{asked->west, asked->south, asked->east, asked->north}) : std::nullopt;
  ExportGrid grid;
  if (!options.raster.system.empty()) {
    grid.samples = asked_grid_in_system(options.raster, archive, ground, box, false);
  } else if (options.raster.size || options.raster.spacing) {
    grid.samples = grid_over(ground, area, options.raster.size, spacing_in_world(options.raster, metadata));
  } else {
    grid.samples = natural_grid(metadata);
    if (options.bbox) {
      const std::optional<SampleGrid> part = part_of(grid.samples, ground);
      if (!part) {
        throw Error(ErrorCode::kInvalidArgument,
                    "--bbox holds no sample of the source's grid; --size or --spacing would");
      }
      grid.samples = *part;
    }
  }
  GridSize size{grid.samples.width, grid.samples.height};
  grid.cut = cut_into_tiles(size, !options.raster.size && !options.raster.spacing, options.tiles, options.tile_size,
                            options.overlap);
  if (size != GridSize{grid.samples.width, grid.samples.height}) {
    if (grid.samples.system) {
      RasterOptions sized = options.raster;
      sized.size = size;
      grid.samples = asked_grid_in_system(sized, archive, ground, box, true);
      return grid;
    }
    grid.samples = grid_over(ground, area, size, std::nullopt);
  }
  return grid;
}

SampleType default_type(const std::string& output) {
  switch (raster_kind(output)) {
    case RasterKind::kHgt:
      return SampleType::kInt16;
    case RasterKind::kPng:
    case RasterKind::kRaw16:
      return SampleType::kUint16;
    default:
      return SampleType::kFloat32;
  }
}

class Exporter {
 public:
  Exporter(const ExportOptions& options, const ArchiveReader& archive, const ExportGrid& grid)
      : options_(options),
        archive_(archive),
        grid_(grid),
        display_(options.work.progress, options.common.quiet, options.common.verbose) {}

  void run() {
    has_voids = needs_void(archive_.metadata(), grid_.samples, options_.raster.output);
    mapping = choose_mapping();
    const auto void_value = void_value_of(mapping.type, has_voids);
    const SampleStore store(mapping, void_value,
                            options_.raster.clamp_range ? SampleStore::Clamp::kAll : SampleStore::Clamp::kNone);
    const RasterTarget target{options_.raster.output, mapping, remedy()};
    ExportTiles tiles(options_.raster.output, grid_.cut, grid_.samples.width);
    const auto spec_of = [&](std::int64_t column, std::int64_t row) {
      SampleGrid part = grid_.samples;
      part.width = grid_.cut.columns;
      part.height = grid_.cut.rows;
      part.first_x += static_cast<double>(column * (grid_.cut.columns - grid_.cut.overlap)) * part.spacing_x;
      const double south = static_cast<double>(row * (grid_.cut.rows - grid_.cut.overlap)) * part.spacing_z;
      part.first_z += part.system ? -south : south;  // northings, and world z
      RasterSpec spec = raster_spec(archive_.metadata(), part, mapping, void_value);
      if (says_place() && !(spec.georeference && spec.georeference->has_origin)) {
        // Of no known place, it lies where it does from the archive's North-West corner on.
        if (!spec.georeference) spec.georeference.emplace().registration = Registration::kPoint;
        Georeference& place = *spec.georeference;
        place.has_origin = true;
        place.origin_x = part.first_x * (place.spacing_x / part.spacing_x);
        place.origin_y = -part.first_z * (place.spacing_y / part.spacing_z);
      }
      spec.overwrite = options_.raster.overwrite;
      spec.scratch = scratch_of(options_.work);
      return spec;
    };
    warn_of_losses(options_.raster.output, spec_of(0, 0));
    for (std::int64_t group = 0; group < tiles.groups(); ++group) {
      tiles.begin_group(group, spec_of);
      counts = {};
      const Job reading = job("export");
      rows(reading).read_all(
          [&](std::int64_t row, std::span<const double> elevations) {
            tiles.write(row, store_rows(store, target, grid_.samples.width, row, elevations, counts));
          },
          reading);
    }
    files = tiles.files();
    written = tiles.written();
  }

  SampleMapping mapping;
  SampleStore::Result counts;
  bool has_voids = false;
  std::int64_t files = 0;
  std::vector<std::string> written;  ///< those beside them as well

 private:
  /// Also of an archive without a place: what lies beside others must say where, and grids always do. All of it in
  /// another format has none, as its source had.
  [[nodiscard]] bool says_place() const {
    const RasterKind kind = raster_kind(options_.raster.output);
    return grid_.cut.asked || options_.bbox || kind == RasterKind::kAsc || kind == RasterKind::kFlt;
  }
  Job job(const char* stage) {
    Job made = job_from(options_.work, display_);
    made.progress = [this, stage](const Progress& at) { display_.update(stage, at.unit, at.done, at.total); };
    return made;
  }
  [[nodiscard]] RowReader rows(const Job& job) const {
    return {archive_, grid_.samples, options_.method(archive_.metadata(), grid_.samples), job};
  }

  [[nodiscard]] std::string remedy() const {
    const Metadata& metadata = archive_.metadata();
    const std::string& output = options_.raster.output;
    if (options_.z_scale || options_.z_offset) {
      const std::string scale = scale_that_holds(metadata.statistics, mapping, has_voids);
      if (!scale.empty())
        return usual_remedy(output, mapping, metadata.statistics, RestoreMethod::kBarycentric) + ", " + scale;
    }
    std::string text = usual_remedy(output, mapping, metadata.statistics, options_.method(metadata, grid_.samples));
    if (raster_kind(output) == RasterKind::kExr) text += ", --type f32 holds it";
    return text;
  }

  SampleMapping choose_mapping() {
    const SampleType type = options_.raster.type.value_or(default_type(options_.raster.output));
    if (options_.z_scale || options_.z_offset) {
      return {type, options_.z_scale.value_or(1.0), options_.z_offset.value_or(0.0)};
    }
    if (is_floating(type)) {
      if (options_.z_range)
        throw Error(ErrorCode::kInvalidArgument, "export: --z-range is for integer types; floats hold elevations");
      if (type == SampleType::kFloat16) warn_of_halves(options_.raster.output, archive_.metadata());
      return {type, 1.0, 0.0};
    }
    if (options_.z_range) return spread(type, *options_.z_range, has_voids);
    const SampleMapping whole{type, 1.0, 0.0};
    if (type == SampleType::kUint8 || type == SampleType::kUint16) {
      const Job reading = job("range");
      return spread_over(type, rows(reading), reading, has_voids);
    }
    if (takes_decimals(archive_.metadata(), whole)) warn_of_whole_numbers(options_.raster.output, archive_.metadata());
    return whole;
  }

  const ExportOptions& options_;
  const ArchiveReader& archive_;
  ExportGrid grid_;
  ProgressDisplay display_;
};

int run(const ExportOptions& options) {
  ArchiveReader archive = open_with_source(options.raster.archive);
  const ExportGrid grid = asked_grid(options, archive);
  RasterSpec spec;
  spec.width = grid.cut.columns;
  spec.height = grid.cut.rows;
  spec.sample_type = options.raster.type.value_or(default_type(options.raster.output));
  spec.overwrite = options.raster.overwrite;
  check_raster_room(options.raster.output, spec, grid.cut.across * grid.cut.down);
  const std::vector<std::string> names = ExportTiles(options.raster.output, grid.cut, grid.samples.width).names();
  for (const std::string& file : names) {
    check_raster_output({options.raster.archive}, file, options.raster.overwrite);
  }
  // What the format does not hold is refused before elevations are looked at.
  (void)create_raster(names.front(), spec);
  Exporter exporter(options, archive, grid);
  WorkArena arena(options.work.threads);
  arena.execute([&] { exporter.run(); });
  const SampleGrid& samples = grid.samples;
  const SampleMapping& mapping = exporter.mapping;
  if (exporter.counts.nodata > 0 && raster_kind(options.raster.output) == RasterKind::kRaw16) {
    print_warning(
        fmt::format("{}: {} voids are written as {}, which an engine takes for a height; `convert --fill` "
                    "closes voids",
                    options.raster.output, describe_count(exporter.counts.nodata),
                    void_value_of(mapping.type, true).value_or(0.0)));
  }
  StandardOutput out;
  if (options.common.json) {
    out.write(json_text({{"archive", options.raster.archive},
                         {"output", options.raster.output},
                         {"method", to_string(options.method(archive.metadata(), samples))},
                         {"width", samples.width},
                         {"height", samples.height},
                         {"first_sample", {{"x", samples.first_x}, {"z", samples.first_z}}},
                         {"spacing", {{"x", samples.spacing_x}, {"z", samples.spacing_z}}},
                         {"tiles",
                          {{"across", grid.cut.across},
                           {"down", grid.cut.down},
                           {"width", grid.cut.columns},
                           {"height", grid.cut.rows},
                           {"overlap", grid.cut.overlap}}},
                         {"files", exporter.files},
                         {"files_written", exporter.written},
                         {"sample_type", to_string(mapping.type)},
                         {"z_scale", mapping.z_scale},
                         {"z_offset", mapping.z_offset},
                         {"voids", exporter.counts.nodata},
                         {"clamped", exporter.counts.clamped}}));
  } else if (!options.common.quiet) {
    std::string what = fmt::format("{} x {} samples of {}, {:.6g} x {:.6g} apart", samples.width, samples.height,
                                   to_string(mapping.type), samples.spacing_x, samples.spacing_z);
    if (exporter.files > 1) {
      what +=
          fmt::format(", in {} x {} files of {} x {}", grid.cut.across, grid.cut.down, grid.cut.columns, grid.cut.rows);
    }
    if (mapping.z_scale != 1.0 || mapping.z_offset != 0.0) {
      what += fmt::format("; elevation = sample * {} + {}", mapping.z_scale, mapping.z_offset);
    }
    if (options.method(archive.metadata(), samples) == RestoreMethod::kPlane) {
      what += kOnAPlane;
    }
    if (exporter.counts.nodata > 0) what += fmt::format(", {} voids", describe_count(exporter.counts.nodata));
    if (exporter.counts.clamped > 0) {
      what += fmt::format(", {} moved into the range", describe_count(exporter.counts.clamped));
    }
    const std::string& written = exporter.files == 1 ? exporter.written.front() : options.raster.output;
    out.write(fmt::format("{}: {}\n", written, what));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_export(const Arguments& arguments) {
  const std::optional<ExportOptions> options = parse_export(arguments);
  return options ? run(*options) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
