/// isohf restore: an archive becomes a raster of elevations again.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "formats/georeference/reference_system.h"
#include "formats/registry.h"
#include "isohf/base/file.h"
#include "isohf/base/sample.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/error.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/describe.h"
#include "options/input_files.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "options/options_raster.h"
#include "options/source_inputs.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"
#include "raster/restored_raster.h"
#include "work_arena.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kRestoreFooter =
    R"(The raster has the samples of the archive's source, at their places, unless another grid is asked for. An
archive made with --lossless gives the source's samples bit for bit, and their SHA-256 is checked; with
--method it gives what its surface alone holds.
Samples are raw numbers in the source's scale and type; only .tif, and the .json beside .png, .r16, .raw
and .r32, have room for scale and offset.
An archive whose input was projected takes --like of a raster in degrees, each of whose samples then goes
through the projection, or of one on its own map.
Methods: hex, quintic B-splines along the lattice rows and then down the columns, is nearest to the source;
barycentric is what a renderer shows; average is the mean over the area of each sample. Samples far apart
are points on a coarse plane, unless a method is asked for. The format follows from RASTER's extension:
.tif, .exr, .png, .hgt, .asc, .flt, .r16, .raw, .r32 or .npy.

Examples:
  isohf restore dem.isohf back.tif
  isohf restore dem.isohf seen.tif --method barycentric
  isohf restore dem.isohf small.tif --size 600x600 --method average
  isohf restore dem.isohf beside.tif --like other.tif)";

struct RestoreOptions {
  CommonOptions common;
  WorkOptions work;
  RasterOptions raster;
  std::string like;
  bool rounds = false;
};

std::optional<RestoreOptions> parse_restore(const Arguments& arguments) {
  RestoreOptions options;
  CommandLine line("restore", "Turns an archive back into a raster of elevations.");
  add_raster_arguments(line, "RASTER", options.raster);
  line.group("Grid");
  line.option(
      "--like", "INPUT",
      "The grid of this raster, or of a folder, \"pattern*\" or @list of them (default: of the archive's source)",
      options.like);
  add_size_options(line, "Write so many samples over the source's ground", options.raster);
  add_method_option(line, "hex; the source's own samples where they are kept", options.raster);
  add_type_option(line, "the source's, as far as the format holds it", options.raster);
  add_clamp_option(line, "RASTER's type", options.raster);
  line.flag("--round", "Round the source's samples to the nearest that a floating RASTER holds, instead of refusing",
            options.rounds);
  add_work_options(line, options.work);
  add_memory_options(line, "RASTER's folder", options.work);
  add_common_options(line, options.common);
  line.footer(kRestoreFooter);
  line.exclusive({"--like", "--size"});
  line.exclusive({"--like", "--spacing"});
  line.exclusive({"--like", "--crs"});
  if (!line.parse(arguments)) return std::nullopt;
  require_raster_arguments(line, "RASTER", options.raster);
  if (options.work.scratch_folder.empty()) options.work.scratch_folder = folder_of(options.raster.output);
  return options;
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
SampleGrid grid_of_other(const RestoreOptions& options, const Metadata& metadata) {
  const OpenedInputs like = open_inputs(expand_inputs({options.like}, false), {}, {}, options.work);
  const SourceInfo other = in_words_of(metadata, like.source->info());
  std::vector<std::string> warnings;
  std::optional<SampleGrid> grid = grid_like(metadata, other, warnings);
  for (const std::string& warning : warnings) print_warning(warning);
  if (!grid) {
    const SourceFrame frame = make_source_frame(other);
    grid = {frame.width,
            frame.height,
            metadata.valid.x0 + frame.first_sample_x,
            metadata.valid.z0 + frame.first_sample_z,
            frame.spacing_x,
            frame.spacing_z};
  }
  if (grid->in_degrees && options.raster.method == RestoreMethod::kHex) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: its rows are no rows of the archive, whose input was projected ({}), and --method hex "
                            "goes along rows; leave it out, or give --method barycentric",
                            options.like, describe_projection(metadata.projection->spec)));
  }
  return *grid;
}

SampleGrid asked_grid(const RestoreOptions& options, ArchiveReader& archive) {
  const RasterOptions& raster = options.raster;
  const Metadata& metadata = archive.metadata();
  if (!raster.system.empty()) return asked_grid_in_system(raster, archive, metadata.valid, std::nullopt, false);
  if (!options.like.empty()) return grid_of_other(options, metadata);
  if (!raster.size && !raster.spacing) return natural_grid(metadata);
  return grid_over(metadata.valid, samples_are_areas(metadata), raster.size, spacing_in_world(raster, metadata));
}

struct Restored {
  SampleStore::Result counts;
  bool is_source = false;               ///< the source's own samples, hash checked
  std::vector<std::string> files;       ///< written
  std::optional<double> rounding;       ///< the largest error of the source's samples, with --round
  std::optional<SampleMapping> spread;  ///< of decimals over an integer type
};

SampleType written_type(const RestoreOptions& options, SampleType of_source) {
  return options.raster.type.value_or(restored_type(options.raster.output, of_source));
}

class Restorer {
 public:
  Restorer(const RestoreOptions& options, const ArchiveReader& archive, const SampleGrid& grid)
      : options_(options),
        archive_(archive),
        grid_(grid),
        display_(options.work.progress, options.common.quiet, options.common.verbose) {
    job_ = job_from(options.work, display_);
    job_.progress = [this](const Progress& at) { display_.update("restore", at.unit, at.done, at.total); };
  }

  Restored run(bool is_lossless) { return is_lossless ? run_lossless() : run_surface(); }

 private:
  [[nodiscard]] std::unique_ptr<RasterSink> open(RasterSpec spec) const {
    spec.overwrite = options_.raster.overwrite;
    spec.scratch = scratch_of(options_.work);
    std::unique_ptr<RasterSink> sink = create_raster(options_.raster.output, spec);
    warn_of_losses(options_.raster.output, sink->spec());
    return sink;
  }

  Restored run_lossless() {
    SourceRowReader reader(archive_, job_);
    const LosslessRecord& record = reader.record();
    const SampleMapping kept = record.mapping;
    SampleMapping written = kept;
    // Text holds any number, and has no place for a scale.
    const bool as_elevations =
        raster_kind(options_.raster.output) == RasterKind::kAsc && (kept.z_scale != 1.0 || kept.z_offset != 0.0);
    written.type = written_type(options_, kept.type);
    if (as_elevations) written = {SampleType::kFloat64, 1.0, 0.0};
    auto void_value = record.void_values.empty() ? std::nullopt : std::optional(record.void_values.front());
    // OpenEXR has no void value; what came from there has none but the user's.
    const bool voids_to_nan = raster_kind(options_.raster.output) == RasterKind::kExr && is_floating(written.type) &&
                              archive_.metadata().source.format != "OpenEXR";
    const bool as_kept = written.type == kept.type && !voids_to_nan && !as_elevations;
    // A void value that the type does not hold is missed only where a sample is void.
    const bool lacks_void =
        void_value && !as_kept && !SampleStore(written, std::nullopt, SampleStore::Clamp::kNone).holds(*void_value);
    if (voids_to_nan || as_elevations || lacks_void) void_value.reset();
    if (!void_value && is_floating(written.type))
      void_value = void_value_of(written.type, needs_void(archive_.metadata(), grid_, options_.raster.output));
    const auto sink = open(source_raster_spec(archive_.metadata(), written, void_value));
    double rounding = 0.0;
    std::int64_t row = 0;
    // Voids that the output has no word for, and how often they stand there: a value each, nullopt by a range.
    std::map<std::optional<double>, std::int64_t> untold;
    const std::optional<double> voids_as = voids_to_nan ? std::nan("") : void_value;
    while (!reader.at_end()) {
      const std::vector<std::byte> raw = reader.read_next();
      const std::size_t count = raw.size() / size_bytes(kept.type);
      if (as_kept && (record.void_values.size() > 1 || archive_.metadata().source.raw_range)) {
        const LoadSample load = load_sample(kept.type);
        for (std::size_t i = 0; i < count; ++i) {
          const double value = load(raw.data() + i * size_bytes(kept.type));
          if (value == void_value || !std::isfinite(value) || !record.is_void(value)) continue;
          const bool is_listed = std::ranges::find(record.void_values, value) != record.void_values.end();
          ++untold[is_listed ? std::optional(value) : std::nullopt];
        }
      }
      if (as_kept) {
        sink->write_rows(raw);
      } else {
        std::vector<std::byte> out(count * size_bytes(written.type));
        if (as_elevations) {
          elevations_of(record, raw, out);
        } else if (const auto refused = convert_exactly(record, raw, voids_as, written.type, out,
                                                        options_.rounds ? &rounding : nullptr)) {
          const auto sample = static_cast<std::int64_t>(*refused);
          const double value = load_sample(kept.type)(raw.data() + *refused * size_bytes(kept.type));
          const bool is_void = record.is_void(value);
          std::string remedy = is_void ? "write .tif, or give --method hex for a void value of its own" : "write .tif";
          if (options_.raster.type) remedy = "without --type it is " + to_string(kept.type) + ", as in the source";
          if (is_floating(written.type) && !options_.rounds) remedy = "--round takes the nearest, .tif holds it";
          refuse_sample(options_.raster.output, written.type, sample % grid_.width, row + sample / grid_.width,
                        fmt::format("{:.9g}{}", value, is_void ? " (void)" : ""), remedy);
        }
        sink->write_rows(out);
      }
      row += static_cast<std::int64_t>(count) / record.width;
    }
    for (const auto& [value, count] : untold) {
      const std::string which =
          value ? fmt::format("hold {:.9g}", *value)
                : fmt::format("lie outside {:.9g} to {:.9g}", record.valid.first, record.valid.second);
      print_warning(
          loss(fmt::format("{}: {} samples {}, which meant no elevation: a reader must be told, as with "
                           "{}; isohf export writes one void value",
                           options_.raster.output, count, which, value ? "--nodata" : "--valid-range")));
    }
    sink->finish();
    return {{}, true, sink->files(), options_.rounds && !as_kept ? std::optional(rounding) : std::nullopt, {}};
  }

  Restored run_surface() {
    const Metadata& metadata = archive_.metadata();
    bool has_voids = needs_void(metadata, grid_, options_.raster.output);
    SampleMapping mapping{written_type(options_, sample_type_from_string(metadata.source.sample_type)),
                          metadata.source.z_scale, metadata.source.z_offset};
    const RestoreMethod method = options_.raster.method.value_or(usual_method(metadata, grid_));
    Restored restored;
    if (takes_decimals(metadata, mapping)) {
      if (has_scale(options_.raster.output)) {
        mapping = spread_over(mapping.type, RowReader(archive_, grid_, method, job_), job_, has_voids);
        restored.spread = mapping;
      } else {
        warn_of_whole_numbers(options_.raster.output, metadata);
      }
    }
    const auto void_value = void_value_of(mapping.type, has_voids);
    const SampleType source_type = sample_type_from_string(metadata.source.sample_type);
    // All samples of the source are of its type: what lies beyond its ends is overshoot.
    const bool is_source_type = mapping.type == source_type && !restored.spread;
    const auto clamp = options_.raster.clamp_range ? SampleStore::Clamp::kAll
                       : is_source_type            ? SampleStore::Clamp::kAtFreeEnds
                                                   : SampleStore::Clamp::kNone;
    const SampleStore store(mapping, void_value, clamp);
    const std::string& output = options_.raster.output;
    const RasterTarget target{output, mapping, usual_remedy(output, mapping, metadata.statistics, method)};
    const auto sink = open(raster_spec(metadata, grid_, mapping, void_value));
    RowReader(archive_, grid_, method, job_)
        .read_all(
            [&](std::int64_t row, std::span<const double> elevations) {
              sink->write_rows(store_rows(store, target, grid_.width, row, elevations, restored.counts));
            },
            job_);
    sink->finish();
    if (restored.counts.clamped > 0 && !options_.raster.clamp_range) {
      display_.clear();
      print_warning(
          fmt::format("{}: the surface overshoots the {} of its source at {} samples; they were moved to its ends",
                      output, to_string(mapping.type), describe_count(restored.counts.clamped)));
    }
    restored.files = sink->files();
    return restored;
  }

  const RestoreOptions& options_;
  const ArchiveReader& archive_;
  SampleGrid grid_;
  ProgressDisplay display_;
  Job job_;
};

/// First sample and spacing, for JSON.
void add_grid(const SampleGrid& grid, ordered_json& json) {
  const char* const x = grid.in_degrees ? "longitude" : grid.system ? "easting" : "x";
  const char* const z = grid.in_degrees ? "latitude" : grid.system ? "northing" : "z";
  json["width"] = grid.width;
  json["height"] = grid.height;
  json["first_sample"] = {{x, grid.first_x}, {z, grid.first_z}};
  json["spacing"] = {{x, grid.spacing_x}, {z, grid.spacing_z}};
}

int run(const RestoreOptions& options) {
  std::vector<std::string> inputs = {options.raster.archive};
  if (!options.like.empty()) {
    for (std::string& file : expand_inputs({options.like}, false)) inputs.push_back(std::move(file));
  }
  check_raster_output(inputs, options.raster.output, options.raster.overwrite);
  WorkArena arena(options.work.threads);
  ArchiveReader archive = open_with_source(options.raster.archive);
  const bool wants_source =
      options.like.empty() && !options.raster.size && !options.raster.spacing && !options.raster.method;
  bool is_lossless = wants_source && lossless_record(archive.metadata());
  SampleGrid grid = source_grid(archive.metadata().source);
  if (!is_lossless || !options.raster.system.empty()) grid = asked_grid(options, archive);
  // In the archive's own system the samples are its source's.
  is_lossless =
      is_lossless && (options.raster.system.empty() || (!grid.goes_by_places() && !is_warped(archive.metadata())));
  RasterSpec file;
  file.width = grid.width;
  file.height = grid.height;
  file.sample_type = written_type(options, sample_type_from_string(archive.metadata().source.sample_type));
  check_raster_room(options.raster.output, file);
  Restored restored;
  try {
    arena.execute([&] { restored = Restorer(options, archive, grid).run(is_lossless); });
  } catch (const Error& error) {
    if (!is_lossless || error.code() != ErrorCode::kCorrupt) throw;
    return print_error(error, kExitDifferences);
  }
  const RestoreMethod method = options.raster.method.value_or(usual_method(archive.metadata(), grid));
  const std::string how = restored.is_source ? "source" : to_string(method);
  StandardOutput out;
  if (options.common.json) {
    ordered_json json = {{"archive", options.raster.archive},
                         {"output", options.raster.output},
                         {"files_written", restored.files},
                         {"method", how}};
    add_grid(grid, json);
    json["source_samples"] = restored.is_source;
    json["voids"] = restored.is_source ? ordered_json(nullptr) : ordered_json(restored.counts.nodata);
    json["clamped"] = restored.counts.clamped;
    json["rounded_by"] = restored.rounding ? ordered_json(*restored.rounding) : ordered_json(nullptr);
    out.write(json_text(json));
  } else if (!options.common.quiet) {
    std::string what = "the source's own samples, SHA-256 as stated";
    if (restored.rounding) {
      what = fmt::format("the source's own samples, SHA-256 as stated, rounded by up to {:.3g}", *restored.rounding);
    }
    if (!restored.is_source) what = fmt::format("method {}, {} voids", how, describe_count(restored.counts.nodata));
    if (!restored.is_source && method == RestoreMethod::kPlane) what += kOnAPlane;
    if (restored.spread) {
      what += fmt::format("; elevation = sample * {} + {}", restored.spread->z_scale, restored.spread->z_offset);
    }
    if (restored.counts.clamped > 0)
      what += fmt::format(", {} moved into the range", describe_count(restored.counts.clamped));
    out.write(fmt::format("{}: {} x {} samples, {}\n", options.raster.output, grid.width, grid.height, what));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_restore(const Arguments& arguments) {
  const std::optional<RestoreOptions> options = parse_restore(arguments);
  return options ? run(*options) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
