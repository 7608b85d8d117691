/// isohf restore: an archive becomes a raster of elevations again.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "formats/registry.h"
#include "interrupt.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/error.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/restore/lossless.h"
#include "open_archive.h"
#include "options/describe.h"
#include "options/input_files.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "options/options_raster.h"
#include "options/source_inputs.h"
#include "output/archive_places.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/standard_output.h"
#include "raster/output_grid.h"
#include "raster/restored_raster.h"
#include "raster/restored_samples.h"
#include "raster/surface_scan.h"
#include "work_arena.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kFooter =
    R"(The raster has the samples of the archive's source, at their places, unless another grid is asked for. An
archive made with --lossless gives the source's samples bit for bit, and their SHA-256 is checked; with
--method it gives what its surface alone holds.
Samples are raw numbers in the source's scale and type; only .tif, and the .json beside .png, .r16, .raw
and .r32, have room for scale and offset.
An archive whose input was projected takes --like of a raster in degrees, each of whose samples then goes
through the projection, or of one on its own map.
Methods: hex, quintic B-splines along the lattice rows and then down the columns, is nearest to the source;
barycentric is what a renderer shows. The format follows from RASTER's extension: .tif, .exr,
.png, .hgt, .asc, .flt, .r16, .raw, .r32 or .npy.

Examples:
  isohf restore dem.isohf back.tif
  isohf restore dem.isohf seen.tif --method barycentric
  isohf restore dem.isohf half.tif --size 600x600
  isohf restore dem.isohf beside.tif --like other.tif)";

struct RestoreOptions {
  CommonOptions common;
  WorkOptions work;
  RasterOptions raster;
  std::string like;
};

std::optional<RestoreOptions> parse(const Arguments& arguments) {
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
  add_clamp_option(line, "RASTER's type", options.raster);
  add_work_options(line, options.work);
  add_common_options(line, options.common);
  line.footer(kFooter);
  line.exclusive({"--like", "--size"});
  line.exclusive({"--like", "--spacing"});
  if (!line.parse(arguments)) return std::nullopt;
  require_raster_arguments(line, "RASTER", options.raster);
  return options;
}

OutputGrid asked_grid(const RestoreOptions& options, const Metadata& metadata) {
  const RasterOptions& raster = options.raster;
  if (!options.like.empty()) {
    const OpenedInputs like = open_inputs(expand_inputs({options.like}, false), {}, {}, options.work.threads);
    std::vector<std::string> warnings;
    OutputGrid grid = grid_like(metadata, like.source->info(), warnings);
    for (const std::string& warning : warnings) {
      if (!options.common.quiet) print_warning(warning);
    }
    if (grid.degrees && raster.method == RestoreMethod::kHex) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("{}: its rows are no rows of the archive, whose input was projected ({}), and --method hex "
                      "goes along rows; leave it out, or give --method barycentric",
                      options.like, describe_projection(metadata.projection->spec)));
    }
    return grid;
  }
  if (!raster.size && !raster.spacing) return OutputGrid(natural_grid(metadata));
  return OutputGrid(
      grid_over(metadata.valid, samples_are_areas(metadata), raster.size, spacing_in_world(raster, metadata)));
}

/// Rows of another map than the archive's are read on the triangles.
RestoreMethod method_of(const RestoreOptions& options, const OutputGrid& grid) {
  return grid.degrees ? RestoreMethod::kBarycentric : options.raster.method.value_or(RestoreMethod::kHex);
}

/// Where the first sample lies and how far the others, for JSON.
ordered_json json_from(const OutputGrid& grid) {
  if (grid.degrees) {
    const GeoGrid& on = *grid.degrees;
    return {{"first_sample", {{"longitude", on.first_sample.longitude}, {"latitude", on.first_sample.latitude}}},
            {"spacing", {{"longitude", on.degrees_x}, {"latitude", on.degrees_y}}}};
  }
  return {{"first_sample", {{"x", grid.world.first_x}, {"z", grid.world.first_z}}},
          {"spacing", {{"x", grid.world.spacing_x}, {"z", grid.world.spacing_z}}}};
}

struct Restored {
  SampleCounts counts;
  bool is_source = false;          ///< the source's own samples, hash checked
  std::vector<std::string> files;  ///< written
};

class Restorer {
 public:
  Restorer(const RestoreOptions& options, const ArchiveReader& archive, const OutputGrid& grid,
           const std::atomic<bool>& cancel)
      : options_(options),
        archive_(archive),
        grid_(grid),
        cancel_(cancel),
        display_(options.work.progress, options.common.quiet, options.common.verbose) {}

  Restored run(const std::optional<LosslessRecord>& record) { return record ? run_lossless(*record) : run_surface(); }

 private:
  [[nodiscard]] std::unique_ptr<RasterSink> open(const SampleMapping& mapping, std::optional<double> void_value,
                                                 bool is_source) const {
    RasterSpec spec = is_source ? source_raster(archive_.metadata(), mapping.type)
                                : restored_raster(archive_.metadata(), grid_, mapping.type);
    set_mapping(spec, mapping, void_value);
    spec.overwrite = options_.raster.overwrite;
    std::unique_ptr<RasterSink> sink = create_raster(options_.raster.output, spec);
    if (!options_.common.quiet) warn_of_lost_scale(options_.raster.output, mapping);
    return sink;
  }

  Restored run_lossless(const LosslessRecord& record) {
    const SampleMapping kept = record.mapping;
    SampleMapping written = kept;
    written.type = restored_type(options_.raster.output, kept.type);
    auto void_value = record.void_values.empty() ? std::nullopt : std::optional(record.void_values.front());
    // OpenEXR has no void value; what came from there has none but the user's.
    const bool voids_to_nan = raster_kind(options_.raster.output) == RasterKind::kExr && is_floating(written.type) &&
                              archive_.metadata().source.format != "OpenEXR";
    const bool as_kept = written.type == kept.type && !voids_to_nan;
    if (voids_to_nan) void_value.reset();
    if (void_value && !as_kept && !SampleStore(written, std::nullopt, false).holds(*void_value)) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{}: {} does not hold the void value {}; write .tif", options_.raster.output,
                              to_string(written.type), *void_value));
    }
    const std::unique_ptr<RasterSink> sink = open(written, void_value, true);
    LosslessReader reader(archive_, record);
    Sha256 hash;
    std::int64_t row = 0;
    while (!reader.at_end()) {
      const std::vector<std::byte> raw = reader.read_next();
      hash.add(raw);
      sink->write_rows(as_kept ? raw : in_type(raw, record, written.type, row, voids_to_nan));
      row += static_cast<std::int64_t>(raw.size() / size_bytes(kept.type)) / record.width;
      report_rows(display_, "restore", row, grid_.world.height, cancel_);
    }
    if (const std::string found = hex(hash.finish()); found != record.sha256) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: the restored samples have the SHA-256 {}, the source's is {}",
                                                   options_.raster.archive, found, record.sha256));
    }
    sink->finish();
    return {{}, true, sink->files()};
  }

  /// The same numbers in another type; refuses what would not be the same.
  [[nodiscard]] std::vector<std::byte> in_type(std::span<const std::byte> raw, const LosslessRecord& record,
                                               SampleType to, std::int64_t first_row, bool voids_to_nan) const {
    const SampleType from = record.mapping.type;
    const std::vector<double>& voids = record.void_values;
    const SampleStore store({to, 1.0, 0.0}, std::nullopt, false);
    const std::size_t count = raw.size() / size_bytes(from);
    std::vector<std::byte> out(count * size_bytes(to));
    for (std::size_t i = 0; i < count; ++i) {
      const double value = load_sample(from, raw.data() + i * size_bytes(from));
      std::byte* const at = out.data() + i * size_bytes(to);
      const bool is_void = !std::isfinite(value) || std::find(voids.begin(), voids.end(), value) != voids.end();
      const SampleStore::Outcome outcome = store.store(is_void && voids_to_nan ? std::nan("") : value, at);
      const bool same = outcome == SampleStore::Outcome::kVoid ||
                        (outcome == SampleStore::Outcome::kStored && load_sample(to, at) == value);
      const auto place = static_cast<std::int64_t>(i);
      if (!same) {
        refuse_sample(options_.raster.output, to, place % grid_.world.width, first_row + place / grid_.world.width,
                      value, "write .tif");
      }
    }
    return out;
  }

  Restored run_surface() {
    const Metadata& metadata = archive_.metadata();
    const SampleMapping mapping{
        restored_type(options_.raster.output, sample_type_from_string(metadata.source.sample_type)),
        metadata.source.z_scale, metadata.source.z_offset};
    const bool has_voids = needs_void(metadata, grid_, options_.raster.output);
    const auto void_value = has_voids ? usual_void(mapping.type) : std::nullopt;
    const SampleStore store(mapping, void_value, options_.raster.clamp_range);
    const std::unique_ptr<RasterSink> sink = open(mapping, void_value, false);
    const SurfaceScan scan(archive_, grid_, method_of(options_, grid_), display_, cancel_);
    Restored restored;
    scan.run("restore", [&](std::int64_t row, std::span<const double> elevations) {
      sink->write_rows(
          store_rows(store, mapping.type, options_.raster.output, grid_.world.width, row, elevations, restored.counts));
    });
    sink->finish();
    restored.files = sink->files();
    return restored;
  }

  const RestoreOptions& options_;
  const ArchiveReader& archive_;
  OutputGrid grid_;
  const std::atomic<bool>& cancel_;
  ProgressDisplay display_;
};

int run(const RestoreOptions& options) {
  std::vector<std::string> inputs = {options.raster.archive};
  if (!options.like.empty()) {
    for (std::string& file : expand_inputs({options.like}, false)) inputs.push_back(std::move(file));
  }
  check_raster_output(inputs, options.raster.output, options.raster.overwrite);
  WorkArena arena(options.work.threads);
  const ArchiveReader archive = open_archive(options.raster.archive);
  const bool wants_source =
      options.like.empty() && !options.raster.size && !options.raster.spacing && !options.raster.method;
  const std::optional<LosslessRecord> record = wants_source ? lossless_record(archive.metadata()) : std::nullopt;
  const OutputGrid grid =
      record ? OutputGrid(source_grid(archive.metadata().source)) : asked_grid(options, archive.metadata());
  const std::atomic<bool>& cancel = watch_interrupts();
  Restored restored;
  try {
    arena.execute([&] { restored = Restorer(options, archive, grid, cancel).run(record); });
  } catch (const Error& error) {
    if (!record || error.code() != ErrorCode::kCorrupt) throw;
    return print_error(error, kExitDifferences);
  }
  const std::string how = restored.is_source ? "source" : to_string(method_of(options, grid));
  StandardOutput out;
  if (options.common.json) {
    const ordered_json places = json_from(grid);
    out.write(json_text({{"archive", options.raster.archive},
                         {"output", options.raster.output},
                         {"files_written", restored.files},
                         {"method", how},
                         {"width", grid.world.width},
                         {"height", grid.world.height},
                         {"first_sample", places.at("first_sample")},
                         {"spacing", places.at("spacing")},
                         {"source_samples", restored.is_source},
                         {"voids", restored.is_source ? ordered_json(nullptr) : ordered_json(restored.counts.voids)},
                         {"clamped", restored.counts.clamped}}));
  } else if (!options.common.quiet) {
    std::string what = "the source's own samples, SHA-256 as stated";
    if (!restored.is_source) what = fmt::format("method {}, {} voids", how, describe_count(restored.counts.voids));
    if (restored.counts.clamped > 0)
      what += fmt::format(", {} moved into the range", describe_count(restored.counts.clamped));
    out.write(
        fmt::format("{}: {} x {} samples, {}\n", options.raster.output, grid.world.width, grid.world.height, what));
  }
  out.finish();
  return kExitDone;
}

}  // namespace

int command_restore(const Arguments& arguments) {
  const std::optional<RestoreOptions> options = parse(arguments);
  return options ? run(*options) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
