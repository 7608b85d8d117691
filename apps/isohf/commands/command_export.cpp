/// isohf export: an archive as a raster of elevations, on its source's grid or any other, whole or cut into tiles.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "commands/export_tiles.h"
#include "formats/adapters/cropped_source.h"
#include "formats/georeference/reference_system.h"
#include "input/box_ground.h"
#include "input/input_files.h"
#include "input/options_source.h"
#include "input/quantities.h"
#include "input/source_inputs.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/work_options.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/restored_raster.h"
#include "output/source_samples.h"
#include "output/standard_output.h"
#include "work_arena.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kExportFooter =
    R"(Without options OUTPUT has the source's grid, reference system, sample type and scale, as far as its format
holds them, whatever the archive was projected to. An archive made with --lossless gives the source's samples bit for
bit, and their SHA-256 is checked. --like and --bbox keep the source's type and scale too. With any other grid,
--method, --raw-scale or --raw-offset the samples are elevations of the surface: float32 in .tif, .exr, .flt, .asc, .r32
and .npy, int16 in .hgt, and in .png, .r16 and .raw uint16 over the range of elevations, with scale and offset in
OUTPUT.json. All tiles share one scale.
With --tile-size OUTPUT is cut: NAME_x0_y0.r16 is the North-West tile, x counts East, y South. Without --size the
size becomes the nearest one that makes whole tiles.
Methods: hex, quintic B-splines along the lattice rows and then down the columns, is nearest to the source;
barycentric is what a renderer shows; average is the mean over the area of each sample. Samples 1.5 times as far apart
as the source's, or farther, are means; rows that are not rows of the archive's map are barycentric.

Examples:
  isohf export dem.isohf back.tif
  isohf export dem.isohf beside.tif --like other.tif
  isohf export dem.isohf dem.tif --spacing 30
  isohf export dem.isohf map.tif --to-crs none
  isohf export dem.isohf alps.png --size 4097x4097
  isohf export dem.isohf part.tif --bbox 6.5,45,7,45.5
  isohf export dem.isohf unreal.r16 --tile-size 1009 --overlap 1)";

/// In --to-crs: the map that an archive lies on, as it is stored.
constexpr const char* kOwnMap = "none";
/// Samples on a side, at most.
constexpr std::int64_t kMostSide = std::int64_t{1} << 31U;

struct ExportOptions {
  const Common& common;
  WorkOptions work{};
  std::string archive{};
  std::string output{};
  bool overwrite = false;
  std::string like{};
  std::optional<GridSize> size{};
  std::optional<LengthValue> spacing{};
  std::string system{};  ///< a reference system, or "none"; empty: the source's
  std::optional<BoundingBox> bbox{};
  std::optional<RestoreMethod> given_method{};
  std::optional<GridSize> tile_size{};
  std::int64_t overlap = 0;
  std::optional<SampleType> type{};
  std::optional<double> raw_scale{};
  std::optional<double> raw_offset{};
  bool clamp_range = false;
  bool surface = false;

  [[nodiscard]] RestoreMethod method(const Metadata& metadata, const SampleGrid& grid) const {
    return given_method.value_or(usual_method(metadata, grid));
  }
  [[nodiscard]] bool has_system() const { return !system.empty() && system != kOwnMap; }
  /// Whether the samples have the source's type and scale: its own all, and of a part those that the format holds.
  [[nodiscard]] bool as_source(const Metadata& metadata) const {
    if (raw_scale || raw_offset) return false;
    const SampleType source = sample_type_from_string(metadata.source.sample_type);
    return !like.empty() || (is_on_sources_grid() && (!bbox || restored_type(output, source) == source));
  }
  /// All of it, or a part.
  [[nodiscard]] bool is_on_sources_grid() const {
    return like.empty() && !size && !spacing && system.empty() && !given_method && !tile_size;
  }
  [[nodiscard]] SampleType written_type(const Metadata& metadata) const {
    return type.value_or(restored_type(
        output, as_source(metadata) ? sample_type_from_string(metadata.source.sample_type) : SampleType::kFloat32));
  }
};

/// "1009" is a square.
GridSize parse_side_or_size(const std::string& text) {
  if (text.find_first_of("xX") != std::string::npos) return parse_size(text, 1, kMostSide);
  const std::int64_t side = parse_whole_number(text, 1, kMostSide);
  return {side, side};
}

/// A system is named and spelled in many ways: the archive's, where the raster's is that.
SourceInfo in_words_of(const Metadata& metadata, SourceInfo other) {
  const auto own = grid_georeference(metadata, natural_grid(metadata));
  const Georeference source = source_georeference(metadata.source);
  ReferenceSystem& theirs = other.georeference.system;
  for (const Georeference& known : {own.value_or(source), source}) {
    if (are_same(known.system, theirs) == true) {
      theirs = known.system;
      return other;
    }
  }
  const bool on_maps = source.unit == HorizontalUnit::kMetre && other.georeference.unit == HorizontalUnit::kMetre;
  if (on_maps && !is_warped(metadata) && are_same(source.system, theirs) == false) {
    refuse_system(other, source.system);
  }
  return other;
}

/// Of the raster in --like.
SampleGrid grid_of_other(const ExportOptions& options, const Metadata& metadata) {
  const OpenedInputs like = open_inputs(expand_inputs({options.like}, false), {}, {}, options.work);
  const SourceInfo other = in_words_of(metadata, like.source->info());
  std::vector<std::string> warnings;
  std::optional<SampleGrid> grid = grid_like(metadata, other, warnings);
  for (const std::string& warning : warnings) print_warning(options.common, warning);
  if (!grid) {
    const SourceFrame frame = make_source_frame(other);
    grid = {frame.width,
            frame.height,
            metadata.valid.x0 + frame.first_sample_x,
            metadata.valid.z0 + frame.first_sample_z,
            frame.spacing_x,
            frame.spacing_z};
  }
  return *grid;
}

/// The grid in --to-crs over a part of the world, which --bbox gives if it is there; warnings are printed.
/// Throws Error{kInvalidArgument} for a system that is not understood, and a spacing in metres where coordinates are
/// degrees.
SampleGrid asked_grid_in_system(const ExportOptions& options, ArchiveReader& archive, const WorldBounds& ground,
                                const std::optional<MapBounds>& box, bool quiet) {
  std::vector<Warning> warnings;
  auto system = understand_grid_system(archive, options.system, warnings);
  if (!quiet) print_warnings(options.common, warnings);
  std::optional<double> spacing;
  if (options.spacing) {
    const Georeference& place = system->place;
    if (options.spacing->in_metres && place.unit == HorizontalUnit::kDegree) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("--spacing has a unit, and coordinates of \"{}\" are degrees; give a plain number of these",
                      place.system.name));
    }
    spacing = options.spacing->in_metres ? options.spacing->value / place.metres_per_unit : options.spacing->value;
  }
  const Metadata& metadata = archive.metadata();
  try {
    const SampleGrid grid = is_warped(metadata) && is_source_system(metadata, *system)
                                ? grid_of_source(metadata, {box, options.size, spacing, false})
                                : grid_in_system(metadata, ground, std::move(system), options.size, spacing);
    if (grid.width <= kMostSide && grid.height <= kMostSide) return grid;
    throw Error(ErrorCode::kInvalidArgument, fmt::format("--spacing makes {} x {} samples, at most {} a side are "
                                                         "possible",
                                                         grid.width, grid.height, kMostSide));
  } catch (const Error& error) {
    throw error.within(options.archive);
  }
}

/// The spacing asked for in the archive's world units. Throws Error{kInvalidArgument} for metres where these are
/// unknown.
std::optional<double> spacing_in_world(const ExportOptions& options, const Metadata& metadata) {
  if (!options.spacing) return std::nullopt;
  if (options.spacing->in_metres && metadata.horizontal_unit != "metre") {
    throw Error(ErrorCode::kInvalidArgument,
                options.archive +
                    ": --spacing has a unit, but the archive's world units are not known; give a plain "
                    "number of these");
  }
  const WorldBounds& ground = metadata.valid;
  const double samples = std::max(ground.x1 - ground.x0, ground.z1 - ground.z0) / options.spacing->value;
  if (!(samples <= static_cast<double>(kMostSide))) {
    throw Error(ErrorCode::kInvalidArgument,
                {"--spacing", fmt::format("{}, for {:.3g} samples along a side", options.spacing->value, samples),
                 fmt::format("wide enough for {} at most", kMostSide), ""});
  }
  return options.spacing->value;
}

struct ExportGrid {
  SampleGrid samples;
  TileCut cut;
};

/// The grid of a projected archive in its source's reference system.
SampleGrid grid_by_source(const ExportOptions& options, ArchiveReader& archive, const std::optional<MapBounds>& box,
                          const std::optional<double>& spacing) {
  try {
    understand_source(archive);
  } catch (const Error& error) {
    throw Error(error.code(), std::string(error.what()) + "; --to-crs none writes the archive's own map");
  }
  try {
    return grid_of_source(archive.metadata(), {box, options.size, spacing, true});
  } catch (const Error& error) {
    throw error.within(box ? fmt::format("--bbox {},{},{},{}", box->west, box->south, box->east, box->north)
                           : options.archive);
  }
}

/// Without tiles; warnings are printed unless it is `quiet`.
SampleGrid asked_samples(const ExportOptions& options, ArchiveReader& archive, bool quiet) {
  const Metadata& metadata = archive.metadata();
  if (!options.like.empty()) return grid_of_other(options, metadata);
  const auto& asked = options.bbox;
  const auto box =
      asked ? std::optional(MapBounds{asked->west, asked->south, asked->east, asked->north}) : std::nullopt;
  if (is_warped(metadata) && options.system.empty())
    return grid_by_source(options, archive, box, spacing_in_world(options, metadata));
  const WorldBounds ground = asked ? ground_in_box(archive, *asked, AcrossEnds::kGoesOn) : metadata.valid;
  if (options.has_system()) return asked_grid_in_system(options, archive, ground, box, quiet);
  if (options.size || options.spacing)
    return grid_over(ground, samples_are_areas(metadata), options.size, spacing_in_world(options, metadata));
  const SampleGrid all = natural_grid(metadata);
  if (!asked) return all;
  if (const std::optional<SampleGrid> part = part_of(all, ground)) return *part;
  throw Error(ErrorCode::kInvalidArgument, "--bbox holds no sample of the source's grid; --size or --spacing would");
}

ExportGrid asked_grid(const ExportOptions& options, ArchiveReader& archive) {
  ExportGrid grid;
  grid.samples = asked_samples(options, archive, false);
  GridSize size{grid.samples.width, grid.samples.height};
  grid.cut = cut_into_tiles(size, !options.size && !options.spacing, options.tile_size, options.overlap);
  if (size != GridSize{grid.samples.width, grid.samples.height}) {
    ExportOptions sized = options;
    sized.size = size;
    grid.samples = asked_samples(sized, archive, true);
  }
  if (grid.samples.goes_by_places() && options.given_method == RestoreMethod::kHex) {
    throw Error(ErrorCode::kInvalidArgument,
                "--method hex goes along rows of the archive's map, and those of OUTPUT are others; leave it out, give "
                "--method barycentric, or --to-crs none");
  }
  return grid;
}

class Exporter {
 public:
  Exporter(const ExportOptions& options, const ArchiveReader& archive, const ExportGrid& grid)
      : options_(options), archive_(archive), grid_(grid), display_(options.common, options.work.progress) {}

  void run(bool is_lossless) { is_lossless ? run_lossless() : run_surface(); }

  SampleMapping mapping;
  SampleStore::Result counts;
  bool has_voids = false;
  std::int64_t files = 0;
  std::vector<std::string> written;  ///< those beside them as well
  std::vector<std::string> removed;  ///< tiles of another cut

 private:
  void run_lossless() {
    const SourceSamplesTarget target{options_.output, options_.type, options_.overwrite, scratch_of(options_.work)};
    WrittenSamples samples = write_source_samples(options_.common, archive_, target, job("export"));
    mapping = samples.mapping;
    written = std::move(samples.files);
    files = 1;
  }

  void run_surface() {
    has_voids = needs_void(archive_.metadata(), grid_.samples, options_.output);
    mapping = choose_mapping();
    const auto void_value = void_value_of(mapping.type, has_voids);
    const SampleStore store(mapping, void_value, clamp());
    const RasterTarget target{options_.output, mapping, remedy()};
    ExportTiles tiles(options_.output, grid_.cut, grid_.samples.width);
    const auto spec_of = [&](std::int64_t column, std::int64_t row) {
      SampleGrid part = grid_.samples;
      part.width = grid_.cut.columns;
      part.height = grid_.cut.rows;
      part.first_x += static_cast<double>(column * (grid_.cut.columns - grid_.cut.overlap)) * part.spacing_x;
      const double south = static_cast<double>(row * (grid_.cut.rows - grid_.cut.overlap)) * part.spacing_z;
      part.first_z += part.goes_by_places() ? -south : south;  // northings, and world z
      RasterSpec spec = raster_spec(archive_.metadata(), part, mapping, void_value);
      if (says_place() && !(spec.georeference && spec.georeference->has_origin)) {
        // Of no known place, it lies where it does from the archive's North-West corner on.
        if (!spec.georeference) spec.georeference.emplace().registration = Registration::kPoint;
        Georeference& place = *spec.georeference;
        place.has_origin = true;
        place.origin_x = part.first_x * (place.spacing_x / part.spacing_x);
        place.origin_y = -part.first_z * (place.spacing_y / part.spacing_z);
      }
      spec.overwrite = options_.overwrite;
      spec.scratch = scratch_of(options_.work);
      return spec;
    };
    warn_of_losses(options_.common, options_.output, spec_of(0, 0));
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
    tiles.finish();
    files = tiles.files();
    written = tiles.written();
    removed = tiles.removed();
    if (counts.clamped == 0 || options_.clamp_range) return;
    display_.clear();
    print_warning(
        options_.common,
        fmt::format("{}: the surface overshoots the {} of its source at {} samples; they were moved to its ends",
                    options_.output, to_string(mapping.type), describe_count(counts.clamped)));
  }

  /// Also of an archive without a place: what lies beside others must say where, and grids always do. All of it in
  /// another format has none, as its source had.
  [[nodiscard]] bool says_place() const {
    const RasterKind kind = raster_kind(options_.output);
    return grid_.cut.asked || options_.bbox ||
           (!options_.as_source(archive_.metadata()) && (kind == RasterKind::kAsc || kind == RasterKind::kFlt));
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
    const std::string& output = options_.output;
    if (options_.raw_scale || options_.raw_offset) {
      const std::string scale = scale_that_holds(metadata.statistics, mapping, has_voids);
      if (!scale.empty())
        return usual_remedy(output, mapping, metadata.statistics, RestoreMethod::kBarycentric) + ", " + scale;
    }
    std::string text = usual_remedy(output, mapping, metadata.statistics, options_.method(metadata, grid_.samples));
    if (raster_kind(output) == RasterKind::kExr) text += ", --type f32 holds it";
    return text;
  }

  /// The source's, where its type and scale are kept; its decimals are spread over an integer type.
  SampleMapping source_mapping() {
    const Metadata& metadata = archive_.metadata();
    const SampleMapping found{options_.written_type(metadata), metadata.source.z_scale, metadata.source.z_offset};
    if (found.type == SampleType::kFloat16 && sample_type_from_string(metadata.source.sample_type) != found.type) {
      warn_of_halves(options_.common, options_.output, metadata);
    }
    if (!takes_decimals(metadata, found)) return found;
    if (has_scale(options_.output)) return spread_over_range(found.type);
    warn_of_whole_numbers(options_.common, options_.output, metadata);
    return found;
  }

  SampleMapping choose_mapping() {
    if (options_.as_source(archive_.metadata())) return source_mapping();
    const SampleType type = options_.written_type(archive_.metadata());
    if (options_.raw_scale || options_.raw_offset) {
      return {type, options_.raw_scale.value_or(1.0), options_.raw_offset.value_or(0.0)};
    }
    if (type == SampleType::kFloat16) warn_of_halves(options_.common, options_.output, archive_.metadata());
    if (type == SampleType::kUint8 || type == SampleType::kUint16) return spread_over_range(type);
    const SampleMapping whole{type, 1.0, 0.0};
    if (takes_decimals(archive_.metadata(), whole))
      warn_of_whole_numbers(options_.common, options_.output, archive_.metadata());
    return whole;
  }

  SampleMapping spread_over_range(SampleType type) {
    const Job reading = job("range");
    return spread_over(type, rows(reading), reading, has_voids);
  }

  /// All samples of the source are of its type: what lies beyond its ends is overshoot.
  [[nodiscard]] SampleStore::Clamp clamp() const {
    if (options_.clamp_range) return SampleStore::Clamp::kAll;
    const bool is_source_type = options_.as_source(archive_.metadata()) &&
                                mapping.type == sample_type_from_string(archive_.metadata().source.sample_type);
    return is_source_type ? SampleStore::Clamp::kAtFreeEnds : SampleStore::Clamp::kNone;
  }

  const ExportOptions& options_;
  const ArchiveReader& archive_;
  ExportGrid grid_;
  ProgressDisplay display_;
};

int run(const ExportOptions& options) {
  std::vector<std::string> inputs = {options.archive};
  if (!options.like.empty()) {
    for (std::string& file : expand_inputs({options.like}, false)) inputs.push_back(std::move(file));
  }
  ArchiveReader archive = open_with_source(options.archive);
  const Metadata& metadata = archive.metadata();
  const bool is_lossless = options.is_on_sources_grid() && !options.bbox && !options.surface &&
                           options.as_source(metadata) && lossless_record(metadata);
  ExportGrid grid;
  if (is_lossless) {
    const SampleGrid source = source_grid(metadata.source);
    grid = {source, {1, 1, source.width, source.height}};
  } else {
    grid = asked_grid(options, archive);
  }
  RasterSpec spec;
  spec.width = grid.cut.columns;
  spec.height = grid.cut.rows;
  spec.sample_type = options.written_type(metadata);
  spec.overwrite = options.overwrite;
  check_raster_room(options.output, spec, grid.cut.across * grid.cut.down);
  const ExportTiles tiles(options.output, grid.cut, grid.samples.width);
  const std::vector<std::string> names = tiles.names();
  for (const std::string& file : names) check_raster_output(inputs, file, options.overwrite);
  if (const std::vector<std::string> others = tiles.others(); !others.empty() && !options.overwrite) {
    throw Error(ErrorCode::kInvalidArgument,
                {others.front(), fmt::format("is a tile of another cut than {} x {}", grid.cut.across, grid.cut.down),
                 "", "--overwrite removes it, or choose another name"});
  }
  // What the format does not hold is refused before elevations are looked at.
  (void)create_raster(names.front(), spec);
  Exporter exporter(options, archive, grid);
  WorkArena arena(options.work.threads);
  arena.execute([&] { exporter.run(is_lossless); });
  const SampleGrid& samples = grid.samples;
  const SampleMapping& mapping = exporter.mapping;
  const RestoreMethod method = options.method(metadata, samples);
  if (exporter.counts.nodata > 0 && raster_kind(options.output) == RasterKind::kRaw16) {
    print_warning(options.common,
                  fmt::format("{}: {} voids are written as {}, which an engine takes for a height; `convert --fill` "
                              "closes voids",
                              options.output, describe_count(exporter.counts.nodata),
                              void_value_of(mapping.type, true).value_or(0.0)));
  }
  StandardOutput out(options.common);
  if (options.common.json) {
    out.write(json_text({{"archive", options.archive},
                         {"output", options.output},
                         {"source_samples", is_lossless},
                         {"method", is_lossless ? "source" : to_string(method)},
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
                         {"tiles_removed", exporter.removed},
                         {"sample_type", to_string(mapping.type)},
                         {"z_scale", mapping.z_scale},
                         {"z_offset", mapping.z_offset},
                         {"voids", is_lossless ? ordered_json(nullptr) : ordered_json(exporter.counts.nodata)},
                         {"clamped", exporter.counts.clamped}}));
  } else if (!options.common.quiet) {
    std::string what = fmt::format("{} x {} samples of {}, {:.6g} x {:.6g} apart", samples.width, samples.height,
                                   to_string(mapping.type), samples.spacing_x, samples.spacing_z);
    if (samples.system) what += ", in " + samples.system->place.system.name;
    if (exporter.files > 1) {
      what +=
          fmt::format(", in {} x {} files of {} x {}", grid.cut.across, grid.cut.down, grid.cut.columns, grid.cut.rows);
    }
    if (mapping.z_scale != 1.0 || mapping.z_offset != 0.0) {
      what += fmt::format("; elevation = sample * {} + {}", mapping.z_scale, mapping.z_offset);
    }
    if (is_lossless) {
      what += ", the source's own, SHA-256 as stated";
    } else if (method == RestoreMethod::kPlane) {
      what += kOnAPlane;
    }
    if (exporter.counts.nodata > 0) what += fmt::format(", {} voids", describe_count(exporter.counts.nodata));
    if (!exporter.removed.empty()) {
      what += fmt::format(", {} tiles of another cut removed",
                          describe_count(static_cast<std::int64_t>(exporter.removed.size())));
    }
    if (exporter.counts.clamped > 0) {
      what += fmt::format(", {} moved into the range", describe_count(exporter.counts.clamped));
    }
    const std::string& written = exporter.files == 1 ? exporter.written.front() : options.output;
    out.write(fmt::format("{}: {}\n", written, what));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

Run add_export(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<ExportOptions>(ExportOptions{common});
  ExportOptions& options = *kept;
  positional(line, "ARCHIVE", "Archive to read", options.archive);
  positional(line, "OUTPUT,-o,--output",
             "Raster to write: .tif, .exr, .png, .hgt, .asc, .flt, .r16, .raw, .r32 or .npy", options.output);
  line.add_flag("--overwrite", options.overwrite, "Replace OUTPUT if it exists, and remove its tiles of another cut");
  group(line, "Grid");
  option(line, "--like", "INPUT", "The grid of this raster, or of a folder, \"pattern*\" or @list of them",
         options.like);
  option(line, "--size", "WxH", "Samples over the source's extent [default: the source's]",
         [&options](const std::string& text) { options.size = parse_size(text, 1, kMostSide); });
  option(line, "--spacing", "LENGTH", "Distance between samples: world units, or with a unit as in 30m, 0.5km, 100ft",
         [&options](const std::string& text) { options.spacing = parse_length(text); });
  option(
      line, "--to-crs", "SYSTEM",
      "Reference system of the raster: EPSG:2154, WKT, a PROJ string, a file containing one, or none for the archive's "
      "own map [default: the source's]",
      [&options](const std::string& text) { options.system = text == kOwnMap ? text : system_from(text); });
  option(line, "--bbox", "W,S,E,N",
         "Only this part, in the source's coordinates; across the 180th meridian W is above E",
         [&options](const std::string& text) { options.bbox = bounding_box_from_string(text); });
  option(line, "--method", "hex|barycentric|average", "Interpolation [default: see below]",
         [&options](const std::string& text) { options.given_method = restore_method_from_string(text); });
  group(line, "Tiles");
  CLI::Option* const tiles =
      option(line, "--tile-size", "N|WxH", "Cut into tiles of this many samples, a file each",
             [&options](const std::string& text) { options.tile_size = parse_side_or_size(text); });
  option(line, "--overlap", "K", "Samples that neighbouring tiles share [default: 0; 1 for shared edges]",
         [&options](const std::string& text) { options.overlap = parse_whole_number(text, 0, 65536); })
      ->needs(tiles);
  group(line, "Samples");
  choice<SampleType>(line, "--type",
                     {{"u8", SampleType::kUint8},
                      {"u16", SampleType::kUint16},
                      {"i16", SampleType::kInt16},
                      {"u32", SampleType::kUint32},
                      {"i32", SampleType::kInt32},
                      {"f16", SampleType::kFloat16},
                      {"f32", SampleType::kFloat32},
                      {"f64", SampleType::kFloat64}},
                     "Sample type [default: the source's, or f32, as far as the format holds it]", options.type);
  option(line, "--raw-scale", "FACTOR", "elevation = stored number x FACTOR + --raw-offset [default: 1]",
         [&options](const std::string& text) { options.raw_scale = parse_positive_number(text); });
  option(line, "--raw-offset", "NUMBER", "See --raw-scale [default: 0]",
         [&options](const std::string& text) { options.raw_offset = parse_number(text); });
  line.add_flag("--clamp-range", options.clamp_range, "Clamp samples that the type does not hold, instead of failing");
  line.add_flag("--surface", options.surface, "Write the surface, also where --lossless kept the source's samples");
  for (const char* rival : {"--size", "--spacing", "--to-crs", "--bbox", "--tile-size"})
    exclusive(line, {"--like", rival});
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
  most_used(line, {"--overwrite", "--like", "--size", "--spacing", "--to-crs", "--bbox", "--tile-size", "--overlap",
                   "--type", "--raw-scale"});
  line.footer(kExportFooter);
  return [kept] {
    if (is_archive_name(kept->output) && kept->archive != kept->output) {
      throw Error(ErrorCode::kInvalidArgument,
                  kept->output + ": OUTPUT has an archive's name; ARCHIVE comes first, OUTPUT last");
    }
    kept->work.scratch_folder = scratch_folder_for(kept->output);
    return run(*kept);
  };
}

}  // namespace isohf::cli
