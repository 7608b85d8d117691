/// isohf export: an archive as a raster of elevations, on its source's grid or any other, whole or cut into tiles, or as
/// a mesh.

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <span>

#include "commands/command.h"
#include "commands/export_mesh.h"
#include "formats/mesh/create_mesh.h"
#include "formats/write/archive_raster.h"
#include "formats/write/raster_tiles.h"
#include "input/box_ground.h"
#include "input/input_files.h"
#include "input/options_source.h"
#include "input/source_inputs.h"
#include "isohf/base/arena.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/restore/raster/export_grid.h"
#include "isohf/restore/raster/raster_samples.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/work_options.h"
#include "output/output_kinds.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

constexpr const char* kExportFooter =
    R"(By default OUTPUT has the source's grid, reference system, sample type and scale, if its format holds them. An
archive made with --lossless returns the source's samples bit for bit, checked by their SHA-256.
With another grid, --method, --raw-scale or --raw-offset the samples are elevations: float32, int16 in .hgt, and uint16
over the range of elevations in .png, .r16 and .raw, with scale and offset in OUTPUT.json.
With --tile-size the North-West tile is NAME_x0_y0.r16; x counts East, y South. All tiles share one scale. Without
--size the size becomes the nearest one that makes whole tiles.
A mesh (.glb, .obj, .ply) has the archive's own triangles, with normals and texture coordinates, without nodata. .glb and
.obj: x East, y up, z South, an object for each tile; .glb has the textures too. .ply: x East, y North, z up.
Methods: hex, quintic B-splines, is nearest to the source; barycentric is what a renderer draws; average is the mean
over each sample's area. Default: average if samples are at least 1.5 times as far apart as the source's, barycentric
if rows are not rows of the archive's map, else hex.

Examples:
  isohf export dem.isohf back.tif
  isohf export dem.isohf beside.tif --like other.tif
  isohf export dem.isohf dem.tif --spacing 30
  isohf export dem.isohf map.tif --to-crs none
  isohf export dem.isohf alps.png --size 4097x4097
  isohf export dem.isohf part.tif --bbox 6.5,45,7,45.5
  isohf export dem.isohf unreal.r16 --tile-size 1009 --overlap 1
  isohf export dem.isohf dem.glb --max-triangles 500000)";

constexpr const char* kRasterOptions[] = {"--like",      "--size",       "--spacing",     "--to-crs",
                                          "--method",    "--tile-size",  "--overlap",     "--type",
                                          "--raw-scale", "--raw-offset", "--clamp-range", "--surface"};
constexpr const char* kMeshOptions[] = {"--tiles", "--level", "--max-triangles", "--max-error", "--exaggeration"};

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
  ExportGridRequest grid{};  ///< but for system and box
  std::string system{};      ///< a reference system, or "none"; empty: the source's
  std::optional<BoundingBox> bbox{};
  std::optional<GridSize> tile_size{};
  std::int64_t overlap = 0;
  std::optional<SampleType> type{};
  RasterRequest samples{};  ///< scale, offset, clamps, method
  bool surface = false;
  ExportMeshOptions mesh{};

  /// All of it, or a part.
  [[nodiscard]] bool is_on_sources_grid() const {
    return like.empty() && !grid.size && !grid.spacing && system.empty() && !samples.method && !tile_size;
  }
  /// Whether the samples have the source's type and scale: its own all, and of a part those that the format holds.
  [[nodiscard]] bool as_source(SampleType source) const {
    if (samples.scale || samples.offset) return false;
    return !like.empty() || (is_on_sources_grid() && (!bbox || held_type(output, source) == source));
  }
};

/// "1009" is a square.
GridSize parse_side_or_size(const std::string& text) {
  if (text.find_first_of("xX") != std::string::npos) return parse_size(text, 1, kMostSide);
  const std::int64_t side = parse_whole_number(text, 1, kMostSide);
  return {side, side};
}

/// A system is named and spelled in many ways: the archive's, if the raster's is that.
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
  if (on_maps && !is_warped(metadata) && are_same(source.system, theirs) == false) refuse_system(other, source.system);
  return other;
}

/// Of the raster in --like, which these files make.
SampleGrid grid_of_other(const ExportOptions& options, const std::vector<std::string>& files,
                         const Metadata& metadata) {
  const OpenedInputs like = open_inputs(files, {}, {}, options.work);
  const SourceInfo other = in_words_of(metadata, like.source->info());
  std::vector<Warning> warnings;
  std::optional<SampleGrid> grid = grid_like(metadata, other, warnings);
  print_warnings(options.common, warnings);
  if (grid) return *grid;
  const SourceFrame frame = make_source_frame(other);
  return {frame.width,
          frame.height,
          metadata.valid.x0 + frame.first_sample_x,
          metadata.valid.z0 + frame.first_sample_z,
          frame.spacing_x,
          frame.spacing_z};
}

struct ExportGrid {
  SampleGrid samples;
  TileCut cut;
};

/// like  the files of --like
ExportGrid asked_grid(const ExportOptions& options, const std::vector<std::string>& like, ArchiveReader& archive) {
  const Metadata& metadata = archive.metadata();
  ExportGridRequest request = options.grid;
  request.on_own_map = options.system == kOwnMap;
  if (!options.system.empty() && !request.on_own_map) {
    std::vector<Warning> warnings;
    request.system = understand_grid_system(archive, options.system, warnings);
    print_warnings(options.common, warnings);
  }
  if (const auto& box = options.bbox) {
    request.box = {box->west, box->south, box->east, box->north};
    if (!is_cut_in_source(metadata, request)) static_cast<void>(ground_in_box(archive, *box, AcrossEnds::kGoesOn));
  }
  if (is_cut_in_source(metadata, request)) {
    try {
      understand_source(archive);
    } catch (const Error& error) {
      throw Error(error.code(), std::string(error.what()) + "; --to-crs none writes the archive's own map");
    }
  }
  const auto choose = [&] {
    try {
      return export_grid(metadata, request);
    } catch (const Error& error) {
      throw error.within(options.archive);
    }
  };
  ExportGrid grid{like.empty() ? choose() : grid_of_other(options, like, metadata), {}};
  GridSize size{grid.samples.width, grid.samples.height};
  grid.cut = cut_into_tiles(size, !request.size && !request.spacing, options.tile_size, options.overlap);
  if (size != GridSize{grid.samples.width, grid.samples.height}) {
    request.size = size;
    grid.samples = choose();
  }
  if (grid.samples.goes_by_places() && options.samples.method == RestoreMethod::kHex) {
    throw Error(ErrorCode::kInvalidArgument,
                "--method hex goes along rows of the archive's map, and those of OUTPUT are others. Use --method "
                "barycentric or --to-crs none");
  }
  return grid;
}

/// Refuses, before any work, outputs that cannot be written.
void check_outputs(const ExportOptions& options, std::vector<std::string> inputs, const RasterTiles& tiles,
                   const TileCut& cut, SampleType type) {
  inputs.push_back(options.archive);
  RasterSpec spec;
  spec.width = cut.columns;
  spec.height = cut.rows;
  spec.sample_type = type;
  spec.overwrite = options.overwrite;
  check_raster_room(options.output, spec, cut.across * cut.down);
  const std::vector<std::string> names = tiles.names();
  for (const std::string& file : names) check_raster_output(inputs, file, options.overwrite);
  if (const std::vector<std::string> others = tiles.others(); !others.empty() && !options.overwrite) {
    throw Error(ErrorCode::kInvalidArgument,
                {others.front(), fmt::format("is a tile of another cut than {} x {}", cut.across, cut.down), "",
                 "--overwrite removes it, or choose another name"});
  }
  // What the format does not hold is refused before elevations are looked at.
  static_cast<void>(create_raster(names.front(), spec));
}

int run(const ExportOptions& options) {
  ArchiveReader archive = open_with_source(options.archive);
  const Metadata& metadata = archive.metadata();
  const RasterTraits traits = raster_traits(options.output);
  const SampleType source_type = sample_type_from_string(metadata.source.sample_type);
  RasterRequest request = options.samples;
  request.path = options.output;
  request.as_source = options.as_source(source_type);
  request.type =
      options.type.value_or(held_type(options.output, request.as_source ? source_type : SampleType::kFloat32));
  request.states_scale = traits.states_scale;
  request.needs_nodata = traits.is_srtm;
  request.voids_are_nan = traits.voids_are_nan;
  request.is_text = traits.is_text;
  const bool is_lossless = options.is_on_sources_grid() && !options.bbox && !options.surface && request.as_source &&
                           lossless_record(metadata);
  std::vector<std::string> like;
  if (!options.like.empty()) like = expand_inputs({options.like}, false);
  ExportGrid grid;
  if (is_lossless) {
    grid.samples = source_grid(metadata.source);
    grid.cut = {1, 1, grid.samples.width, grid.samples.height};
  } else {
    grid = asked_grid(options, like, archive);
  }
  const auto& [samples, cut] = grid;
  RasterTiles tiles(options.output, cut);
  check_outputs(options, like, tiles, cut, request.type);

  ProgressDisplay display(options.common, options.work.progress);
  const Job job = job_from(options.work, display);
  const auto warn = [&](const std::vector<Warning>& warnings) {
    display.clear();
    print_warnings(options.common, warnings);
  };
  std::unique_ptr<RasterSamples> raw;
  std::vector<std::string> removed;
  const auto tile_spec = [&](std::int64_t column, std::int64_t row) {
    const SampleGrid tile = window_of(samples, column * (cut.columns - cut.overlap), row * (cut.rows - cut.overlap),
                                      {cut.columns, cut.rows});
    RasterSpec spec = spec_of(metadata, tile, raw->mapping(), raw->nodata());
    if (is_lossless && is_warped(metadata)) spec.georeference = source_georeference(metadata.source);
    if (cut.is_cut || options.bbox || (traits.has_place && !request.as_source)) place_in_world(tile, spec.georeference);
    spec.overwrite = options.overwrite;
    spec.scratch = scratch_of(options.work);
    return spec;
  };
  Arena(job).execute([&] {
    raw = is_lossless ? source_samples(archive, request, job) : surface_samples(archive, samples, request, job);
    warn(raw->warnings());
    warn(losses_of(options.output, tile_spec(0, 0)));
    for (std::int64_t group = 0; group < tiles.groups(); ++group) {
      tiles.begin_group(group, tile_spec);
      raw->read_all([&](std::int64_t row, std::span<const std::byte> rows) { tiles.write(row, rows); });
    }
    warn(raw->warnings());
    if (traits.is_bare && raw->counts().nodata > 0 && !is_floating(raw->mapping().type)) {
      warn(
          {fmt::format("{}: {} nodata samples are written as {}, which an engine takes for a height; convert with "
                       "--fill to fill them",
                       options.output, raw->counts().nodata, raw->nodata().value_or(0.0))});
    }
    removed = tiles.finish();
  });
  display.clear();

  const SampleMapping& mapping = raw->mapping();
  const SampleStore::Result counts = raw->counts();
  const RestoreMethod method = request.method.value_or(usual_method(metadata, samples));
  const bool is_one = cut.across * cut.down == 1;
  Report report;
  report.add("archive", options.archive);
  report.add(
      "output", options.output, is_one ? "raster" : "tiles",
      fmt::format("{}: {} x {} samples of {}{}", is_one ? tiles.written().front() : options.output, samples.width,
                  samples.height, to_string(mapping.type), is_lossless ? ", the source's own, SHA-256 as stated" : ""));
  report.add("source_samples", is_lossless);
  report.add("method", is_lossless ? "source" : to_string(method));
  report.add("width", samples.width);
  report.add("height", samples.height);
  report.add("first_sample", {{"x", samples.first_x}, {"z", samples.first_z}});
  report.add("spacing", {{"x", samples.spacing_x}, {"z", samples.spacing_z}}, "spacing",
             fmt::format("{:.6g} x {:.6g}{}{}", samples.spacing_x, samples.spacing_z,
                         samples.system ? ", in " + samples.system->place.system.name : "",
                         !is_lossless && method == RestoreMethod::kPlane ? "; means on an overview" : ""));
  report.add("tiles",
             {{"across", cut.across},
              {"down", cut.down},
              {"width", cut.columns},
              {"height", cut.rows},
              {"overlap", cut.overlap}},
             "files",
             cut.is_cut ? fmt::format("{} x {} of {} x {} samples{}", cut.across, cut.down, cut.columns, cut.rows,
                                      removed.empty() ? "" : fmt::format("; {} of another cut removed", removed.size()))
                        : "");
  report.add("files", cut.across * cut.down);
  report.add("files_written", tiles.written());
  report.add("tiles_removed", removed);
  report.add("sample_type", to_string(mapping.type));
  report.add("z_scale", mapping.z_scale, "elevation",
             mapping.z_scale != 1.0 || mapping.z_offset != 0.0
                 ? fmt::format("sample x {:.9g} {} {:.9g}", mapping.z_scale, mapping.z_offset < 0.0 ? '-' : '+',
                               std::abs(mapping.z_offset))
                 : "");
  report.add("z_offset", mapping.z_offset);
  report.add("voids", is_lossless ? nlohmann::ordered_json() : nlohmann::ordered_json(counts.nodata), "nodata",
             counts.nodata > 0 ? describe_count(counts.nodata) + " samples" : "");
  report.add("clamped", counts.clamped, "clamped",
             counts.clamped > 0 ? describe_count(counts.clamped) + " samples" : "");
  report.print(options.common);
  return kExitDone;
}

}  // namespace

Run add_export(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<ExportOptions>(ExportOptions{common});
  ExportOptions& options = *kept;
  positional(line, "ARCHIVE", "Archive to read", options.archive);
  positional(line, "OUTPUT,-o,--output",
             "Raster to write: .tif, .exr, .png, .hgt, .asc, .flt, .r16, .raw, .r32 or .npy; or mesh: .glb, .obj or "
             ".ply",
             options.output);
  line.add_flag("--overwrite", options.overwrite, "Replace OUTPUT if it exists, and remove its tiles of another cut");
  group(line, "Grid");
  option(line, "--like", "INPUT", "Use the grid of this raster, or of a folder, \"pattern*\" or @list of them",
         options.like);
  option(line, "--size", "WxH", "Write this many samples over the source's extent [default: the source's]",
         [&options](const std::string& text) { options.grid.size = parse_size(text, 1, kMostSide); });
  option(line, "--spacing", "LENGTH", "Set the distance between samples, in world units or as in 30m, 0.5km, 100ft",
         [&options](const std::string& text) {
           const LengthValue length = parse_length(text);
           options.grid.spacing = length.value;
           options.grid.spacing_in_metres = length.in_metres;
         });
  option(line, "--to-crs", "SYSTEM",
         "Reproject to EPSG:2154, WKT, a PROJ string, a file containing one, or none for the archive's own map "
         "[default: the source's]",
         [&options](const std::string& text) { options.system = text == kOwnMap ? text : system_from(text); });
  option(line, "--bbox", "W,S,E,N",
         "Write only this part, in the source's coordinates; W above E crosses the 180th meridian",
         [&options](const std::string& text) { options.bbox = bounding_box_from_string(text); });
  option(line, "--method", "hex|barycentric|average", "Interpolate by this method [default: see below]",
         [&options](const std::string& text) { options.samples.method = restore_method_from_string(text); });
  group(line, "Tiles");
  CLI::Option* const tiles =
      option(line, "--tile-size", "N|WxH", "Cut into tiles of this many samples, a file each",
             [&options](const std::string& text) { options.tile_size = parse_side_or_size(text); });
  option(line, "--overlap", "K", "Share this many samples between neighbouring tiles [default: 0]",
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
                     "Write samples of this type [default: the source's, or f32, if the format holds it]",
                     options.type);
  option(line, "--raw-scale", "FACTOR", "Store numbers so that elevation = number x FACTOR + --raw-offset [default: 1]",
         [&options](const std::string& text) { options.samples.scale = parse_positive_number(text); });
  option(line, "--raw-offset", "NUMBER", "Add NUMBER, as --raw-scale says [default: 0]",
         [&options](const std::string& text) { options.samples.offset = parse_number(text); });
  line.add_flag("--clamp-range", options.samples.clamps,
                "Clamp samples that the type does not hold, instead of failing");
  line.add_flag("--surface", options.surface, "Write the surface, even if --lossless kept the source's samples");
  group(line, "Meshes");
  CLI::Option* const mesh_tiles =
      option(line, "--tiles", "A:B,C:D", "Take columns A to B-1 and rows C to D-1 of tiles, from 0 in the North-West",
             [&options](const std::string& text) { options.mesh.mesh.tiles = parse_tile_range(text); });
  option(line, "--level", "N",
         "Take this level of detail, 0 is full; beyond the tiles' levels, of overviews [default: 0]",
         [&options](const std::string& text) {
           options.mesh.mesh.level = static_cast<int>(parse_whole_number(text, 0, 255));
         });
  option(line, "--max-triangles", "N", "Take the finest level that has at most N triangles",
         [&options](const std::string& text) {
           options.mesh.mesh.max_triangles = parse_whole_number(text, 1, std::int64_t{1} << 40U);
         });
  option(line, "--max-error", "E", "Take for each tile its coarsest level within E of level 0, in elevation units",
         [&options](const std::string& text) { options.mesh.mesh.max_error = parse_positive_number(text); });
  option(line, "--exaggeration", "F", "Make heights F times as high [default: 1]",
         [&options](const std::string& text) { options.mesh.exaggeration = parse_positive_number(text); });
  exclusive(line, {"--level", "--max-triangles", "--max-error"});
  mesh_tiles->excludes(line.get_option("--bbox"));
  for (const char* rival : {"--size", "--spacing", "--to-crs", "--bbox", "--tile-size"})
    exclusive(line, {"--like", rival});
  add_work_options(line, options.work, common);
  add_memory_option(line, options.work);
  most_used(line, {"--overwrite", "--like", "--size", "--spacing", "--to-crs", "--bbox", "--tile-size",
                   "--max-triangles", "--type", "--raw-scale"});
  line.footer(kExportFooter);
  return [kept, &line] {
    const bool is_mesh = is_mesh_name(kept->output);
    for (const char* const option : is_mesh ? std::span<const char* const>(kRasterOptions) : kMeshOptions) {
      if (!given(line, option)) continue;
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{} is for {}, and {} is not one", option, is_mesh ? "rasters" : "meshes", kept->output));
    }
    if (is_mesh) {
      kept->mesh.archive = kept->archive;
      kept->mesh.output = kept->output;
      kept->mesh.overwrite = kept->overwrite;
      kept->mesh.bbox = kept->bbox;
      return export_mesh(kept->mesh, kept->common, kept->work);
    }
    if (is_archive_name(kept->output) && kept->archive != kept->output) {
      throw Error(ErrorCode::kInvalidArgument,
                  kept->output + ": OUTPUT has an archive's name; ARCHIVE comes first, OUTPUT last");
    }
    kept->work.scratch_folder = scratch_folder_for(kept->output);
    return run(*kept);
  };
}

}  // namespace isohf::cli
