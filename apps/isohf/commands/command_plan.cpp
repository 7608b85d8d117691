/// isohf plan: tile shapes, or what convert would make of an input.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>

#include "commands/command.h"
#include "input/convert_setup.h"
#include "input/input_files.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/memory_plan.h"
#include "isohf/error.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "output/accuracy_output.h"
#include "output/json_output.h"
#include "output/lattice_json.h"
#include "output/report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kPlanFooter =
    R"(Takes the options of convert but --max-error, and writes nothing; sizes are estimates. With --shard the whole input is read, and the
options are printed that the shards need. Without INPUT the candidates for a tile are listed, best true aspect first:
(R-3)sin60/(C-4), 1 is equilateral.

Examples:
  isohf plan --levels 4 --shape 10000
  isohf plan --shape 212x243
  isohf plan dem.tif --density 0.866
  isohf plan tiles/                   what many rasters make together
  isohf plan tiles/ --shard 1/64      the --z-range for the shards)";

constexpr const char* kTableHeading =
    "     C      R  levels   aspect  (printed)   triangles     samples        bytes     strip    stitch";

std::string table_row(const TileShape& shape, CodeType type) {
  std::int64_t strips = 0;  // indices of all levels
  std::int64_t stitches = 0;
  for (int level = 0; level < shape.levels(); ++level) {
    strips += shape.strip_index_count(level);
    stitches += shape.stitch_index_count(level);
  }
  return fmt::format("{:>6} {:>6} {:>7} {:>8.5f} {:>10.3f} {:>11} {:>11} {:>12} {:>9} {:>9}", shape.columns(),
                     shape.rows(), shape.levels(), shape.aspect(), shape.printed_aspect(), shape.triangle_count(),
                     shape.stored_vertex_count(), shape.stored_vertex_count() * raw_bytes(type), strips, stitches);
}

constexpr const char* kTableNotes =
    "\naspect   true aspect of the drawn triangles, (R-3)sin60/(C-4); printed: the paper's R sin60/C\n"
    "samples  stored elevations of a tile, C*R; bytes: of these before compression\n"
    "strip    indices of the strips of all levels; stitch: of the stitches\n";

std::vector<TileShape> shapes_for(const PlanRequest& request) {
  constexpr int kDefaultLevels = 4;
  constexpr int kMostCandidates = 10;
  const int levels = request.levels.value_or(kDefaultLevels);
  if (request.shape) return {TileShape::make(request.shape->first, request.shape->second, levels)};
  std::vector<TileShape> shapes = candidate_shapes(request, kMostCandidates);
  if (shapes.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("no tile shape of {} levels is near {}; request more triangles or fewer --levels", levels,
                            request.budget ? request.budget->count : 0));
  }
  return shapes;
}

int list_candidates(const ConvertCommandOptions& options) {
  const CodeType type = options.convert.code_type;
  const std::vector<TileShape> shapes = shapes_for(options.convert.plan);
  StandardOutput out(options.common);
  if (options.common.json) {
    ordered_json list = ordered_json::array();
    for (const TileShape& shape : shapes) {
      list.push_back(json_from(shape));
      list.back()["raw_bytes"] = shape.stored_vertex_count() * raw_bytes(type);
    }
    out.write(json_text({{"code_type", to_string(type)}, {"candidates", list}}));
  } else {
    std::string text = std::string(kTableHeading) + "\n";
    for (const TileShape& shape : shapes) text += table_row(shape, type) + "\n";
    out.write(text + kTableNotes);
  }
  out.finish();
  return kExitDone;
}

Report report_of(const SourceInfo& info, const Plan& plan, const MemoryPlan& memory, const ConvertOptions& options,
                 const ErrorEstimate& error) {
  const TileGrid& grid = plan.grid;
  const TileShape& shape = grid.shape();
  const SourceFrame& frame = plan.frame;
  const WorldBounds covered = frame.bounds();
  const auto length = [&](double value) { return describe_length(value, frame.in_metres); };
  const std::uint64_t raw = static_cast<std::uint64_t>(plan.lattice_samples * raw_bytes(options.code_type));
  Report report;
  report.add("input",
             {{"path", info.path},
              {"format", info.format},
              {"width", info.width},
              {"height", info.height},
              {"sample_type", to_string(info.sample_type)},
              {"channel", info.channel},
              {"registration", to_string(frame.registration)},
              {"spacing_x", frame.spacing_x},
              {"spacing_z", frame.spacing_z},
              {"in_metres", frame.in_metres},
              {"warnings", json_from(info.warnings)}},
             "input",
             fmt::format("{}: {}, {} x {} {}{}", info.path, info.format, info.width, info.height,
                         to_string(info.sample_type), info.channel.empty() ? "" : ", channel " + info.channel));
  report.add("shape", json_from(shape));
  report.add(
      "grid", json_from(grid), "tiles",
      fmt::format("{} x {} of {}x{}, {} levels, aspect {:.5f}, {} triangles each", grid.tile_columns(),
                  grid.tile_rows(), shape.columns(), shape.rows(), shape.levels(),
                  grid.sigma_x() * std::numbers::sqrt3 / grid.sigma_z(), describe_count(shape.triangle_count())));
  report.add("density", plan.density, "lattice",
             fmt::format("columns {} apart, rows {}; {:.4g} vertices per sample", length(2.0 * grid.sigma_x()),
                         length(grid.sigma_z()), plan.density));
  const std::string map = describe_map(frame.projection, frame.ground, options.plan.ground.why_no_map, frame.wraps_x);
  if (!map.empty()) report.line("map", map);
  report.add("projection",
             frame.projection ? ordered_json::parse(format_projection(*frame.projection)) : ordered_json(nullptr));
  report.add("ground", frame.ground ? ordered_json::parse(format_ground(*frame.ground)) : ordered_json(nullptr));
  report.add("wraps_x", frame.wraps_x);
  report.add("covered", json_from(covered));
  report.add("lattice_samples", plan.lattice_samples);
  report.add("code_type", to_string(options.code_type));
  report.add("raw_bytes", raw);
  report.add("estimated_archive_bytes", plan.estimated_bytes, "archive",
             fmt::format("about {}; {} vertices are {} as {}", describe_bytes(plan.estimated_bytes),
                         describe_count(plan.lattice_samples), describe_bytes(raw), to_string(options.code_type)));
  report.add("expected_error", json_from_estimate(error), "expected",
             describe_estimate(error, info.vertical_unit.empty() ? "" : " " + info.vertical_unit));
  report.add("estimated_memory_bytes", memory.bytes, "memory",
             fmt::format("about {} while converting{}; --memory can be as small as {}", describe_bytes(memory.bytes),
                         memory.scratch_bytes == 0
                             ? ""
                             : fmt::format(", and up to {} of a temporary file", describe_bytes(memory.scratch_bytes)),
                         describe_bytes(memory.least_bytes)));
  report.add("least_memory_bytes", memory.least_bytes);
  report.add("scratch_bytes", memory.scratch_bytes);
  report.detail("samples", fmt::format("{} apart in x, {} in z, registered as {}", length(frame.spacing_x),
                                       length(frame.spacing_z), to_string(frame.registration)));
  report.detail("extent", fmt::format("{} by {}, tiles of {} by {}", length(grid.world_width()),
                                      length(grid.world_height()), length(grid.extent_x()), length(grid.extent_z())));
  report.detail("input at",
                fmt::format("x {:.6g}..{:.6g}, z {:.6g}..{:.6g}", covered.x0, covered.x1, covered.z0, covered.z1));
  return report;
}

/// The options that make the shards of a conversion agree, found by reading the whole input.
void add_shard_options(HeightSource& source, const ConvertCommandOptions& options, const Job& job, Report& report) {
  const ConvertOptions& how = options.convert;
  const std::optional<ShardRange> found = shard_range(source, *options.shard, how, job);
  std::string words = found ? fmt::format("--z-range {}:{}", found->min, found->max) : "--type f32";
  if (found && how.step && *how.step != 0.0) words += fmt::format(" --step {}", *how.step);
  report.add("shards", options.shard->count);
  report.add("z_range", found ? ordered_json{found->min, found->max} : ordered_json(nullptr));
  report.add("shard_options", words, "shards", words);
}

int preview(ConvertCommandOptions& options) {
  if (options.convert.max_error)
    throw Error(ErrorCode::kInvalidArgument, "what --max-error chooses is found by converting; leave it out");
  const Common& common = options.common;
  const Prepared prepared = prepare(options, expand_inputs(options.inputs.names, options.inputs.recursive));
  HeightSource& source = *prepared.source;
  const SourceInfo& info = source.info();
  const ConvertOptions& how = options.convert;
  const Plan plan = make_plan(info, how.plan);
  ProgressDisplay display(common, options.work.progress);
  const Job job = job_from(options.work, display);
  const MemoryPlan memory = plan_memory(source, plan, how, job);
  const std::vector<Warning> warnings = plan_warnings(info, plan, how.plan);
  std::vector<Warning> all = info.warnings;
  all.insert(all.end(), warnings.begin(), warnings.end());
  if (std::string scale = scale_warning(info, plan.frame, how.plan.ground.projection); !scale.empty())
    all.emplace_back(std::move(scale));
  ErrorEstimate error;
  try {
    check_memory(source, memory, job);
    error = estimate_error(source, how, job);
  } catch (const Error& refusal) {
    if (refusal.code() != ErrorCode::kOutOfMemory || job.memory_bytes != 0) throw;  // a bound that was given
    error.why_none = "the conversion would be refused";
    all.emplace_back(fmt::format("convert would refuse: {}", refusal.what()));
  }
  print_warnings(common, all);
  Report report = report_of(info, plan, memory, how, error);
  report.add("memory_bound_bytes", job.bound_bytes());
  report.add("warnings", json_from(warnings));
  if (options.shard) add_shard_options(source, options, job, report);
  display.clear();
  report.print(common);
  return kExitDone;
}

}  // namespace

Run add_plan(CLI::App& line, Common& common) {
  const auto options = std::make_shared<ConvertCommandOptions>(ConvertCommandOptions{common});
  positionals(line, "[INPUT...] [OUTPUT.isohf]", "As for convert; without INPUT, tile shapes are listed",
              options->inputs.names);
  add_conversion_options(line, *options, common);
  most_used(line, {"--shape", "--levels", "--density", "--spacing", "--crs", "--to-crs", "--type", "--memory"});
  line.footer(kPlanFooter);
  return [options, &line] {
    if (options->inputs.names.empty()) {
      for (const CLI::Option* option : line.get_options()) {
        const std::string name = long_name(*option);
        if (option->count() == 0 || name == "--shape" || name == "--levels" || name == "--type") continue;
        throw Error(ErrorCode::kInvalidArgument, name + " needs an INPUT");
      }
      return list_candidates(*options);
    }
    complete(line, *options);
    return preview(*options);
  };
}

}  // namespace isohf::cli
