/// isohf plan: tile shapes, or what convert would make of an input.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "input/input_files.h"
#include "input/options_ground.h"
#include "input/options_lattice.h"
#include "input/options_source.h"
#include "input/source_inputs.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "options/describe.h"
#include "options/option_values.h"
#include "options/options_common.h"
#include "output/json_output.h"
#include "output/plan_report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kPlanFooter =
    R"(Without INPUT the candidates for a tile are listed, best true aspect first: (R-3)sin60/(C-4), 1 is
equilateral. With INPUT nothing is written; sizes are estimates.

Examples:
  isohf plan --levels 4 --shape 10000
  isohf plan --shape 212x243
  isohf plan dem.tif --density 0.866
  isohf plan tiles/                   what many rasters make together)";

struct PlanOptions {
  CommonOptions common;
  WorkOptions work;
  SourceInputs inputs;
  OpenOptions open;

  PlanRequest request;
  GeoidRequest geoid;
  CodeType code_type = CodeType::kU16;
  bool spacing_in_metres = false;
};

std::optional<PlanOptions> parse_plan(const Arguments& arguments) {
  PlanOptions options;
  CommandLine line("plan", "Lists tile shapes, or previews a conversion.");
  line.group("Arguments");
  line.positionals("[INPUT...]",
                   "Rasters of elevations: files, folders, \"patterns*\" and @lists, which form one source (default: "
                   "none, list shapes)",
                   options.inputs.names);
  add_shape_options(line, options.request);
  line.group("Candidates");
  add_code_type_option(line, options.code_type);
  add_lattice_options(line, options.request, options.spacing_in_metres);
  add_ground_options(line, options.request.ground);
  add_geoid_option(line, options.geoid);
  add_source_options(line, options.open);
  add_mosaic_options(line, options.inputs);
  add_threads_option(line, options.work.threads);
  add_memory_option(line, options.work);
  add_common_options(line, options.common);
  line.footer(kPlanFooter);
  if (!line.parse(arguments)) return std::nullopt;
  const auto refuse = [](const std::string& why) { throw Error(ErrorCode::kInvalidArgument, "plan: " + why); };
  if (options.inputs.names.empty()) {
    const std::string option = line.first_given({"Lattice", "Ground", "Input", "Several inputs", "Work"});
    if (!option.empty()) refuse(option + " needs an INPUT");
  }
  return options;
}

std::int64_t stitch_indices_of_all_levels(const TileShape& shape) {
  std::int64_t count = 0;
  for (int level = 0; level < shape.levels(); ++level) count += shape.stitch_index_count(level);
  return count;
}

std::int64_t strip_indices_of_all_levels(const TileShape& shape) {
  std::int64_t count = 0;
  for (int level = 0; level < shape.levels(); ++level) count += shape.strip_index_count(level);
  return count;
}

constexpr const char* kTableHeading =
    "     C      R  levels   aspect  (printed)   triangles     samples        bytes     strip    stitch";

std::string table_row(const TileShape& shape, CodeType type) {
  return fmt::format("{:>6} {:>6} {:>7} {:>8.5f} {:>10.3f} {:>11} {:>11} {:>12} {:>9} {:>9}", shape.columns(),
                     shape.rows(), shape.levels(), shape.aspect(), shape.printed_aspect(), shape.triangle_count(),
                     shape.stored_vertex_count(), shape.stored_vertex_count() * raw_bytes(type),
                     strip_indices_of_all_levels(shape), stitch_indices_of_all_levels(shape));
}

constexpr const char* kTableNotes =
    "\naspect   true aspect of the drawn triangles, (R-3)sin60/(C-4); printed: the paper's R sin60/C\n"
    "samples  stored elevations of a tile, C*R; bytes: of these before compression\n"
    "strip    indices of the strips of all levels; stitch: of the stitches\n";

ordered_json json_with_bytes(const TileShape& shape, CodeType type) {
  ordered_json json = json_from(shape);
  json["raw_bytes"] = shape.stored_vertex_count() * raw_bytes(type);
  return json;
}

std::vector<TileShape> shapes_for(const PlanOptions& options) {
  constexpr int kDefaultLevels = 4;
  constexpr int kMostCandidates = 10;
  const PlanRequest& request = options.request;
  const int levels = request.levels.value_or(kDefaultLevels);
  if (request.shape) return {TileShape::make(request.shape->first, request.shape->second, levels)};
  std::vector<TileShape> shapes = candidate_shapes(request, kMostCandidates);
  if (shapes.empty()) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("plan: no tile shape of {} levels lies near {}; ask for more of them or for fewer --levels",
                            levels, request.budget ? request.budget->count : 0));
  }
  return shapes;
}

void list_candidates(const PlanOptions& options) {
  const std::vector<TileShape> shapes = shapes_for(options);
  StandardOutput out;
  if (options.common.json) {
    ordered_json list = ordered_json::array();
    for (const TileShape& shape : shapes) list.push_back(json_with_bytes(shape, options.code_type));
    out.write(json_text({{"code_type", to_string(options.code_type)}, {"candidates", list}}));
  } else {
    std::string text = std::string(kTableHeading) + "\n";
    for (const TileShape& shape : shapes) text += table_row(shape, options.code_type) + "\n";
    out.write(text + kTableNotes);
  }
  out.finish();
}

int run(const PlanOptions& options) {
  if (options.inputs.names.empty()) {
    list_candidates(options);
  } else {
    SourceInputs inputs = options.inputs;
    inputs.onto = options.request.ground.projection;
    OpenedInputs opened =
        open_inputs(expand_inputs(inputs.names, inputs.recursive), inputs, options.open, options.work);
    ConvertOptions convert;
    convert.plan = options.request;
    if (opened.is_reprojected) convert.plan.ground.projection = ProjectionRequest{};
    const std::unique_ptr<HeightSource> source =
        laid_out(std::move(opened.source), options.geoid, convert.plan.ground, false);
    understand_ground(source->info(), convert.plan.ground);
    convert.code_type = options.code_type;
    convert.source_note = opened.note;
    check_spacing_unit(source->info(), convert.plan, options.spacing_in_metres);
    print_plan(*source, convert, job_from(options.work), options.common);
  }
  return kExitDone;
}

}  // namespace

int command_plan(const Arguments& arguments) {
  const std::optional<PlanOptions> options = parse_plan(arguments);
  return options ? run(*options) : static_cast<int>(kExitDone);
}

}  // namespace isohf::cli
