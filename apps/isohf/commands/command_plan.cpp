/// isohf plan: tile shapes, or what convert would make of an input.

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "input/convert_setup.h"
#include "input/input_files.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/work_options.h"
#include "output/json_output.h"
#include "output/plan_report.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

constexpr const char* kPlanFooter =
    R"(Takes every option of convert and writes nothing; sizes are estimates. Without INPUT the candidates for a tile are listed,
best true aspect first: (R-3)sin60/(C-4), 1 is equilateral.

Examples:
  isohf plan --levels 4 --shape 10000
  isohf plan --shape 212x243
  isohf plan dem.tif --density 0.866
  isohf plan tiles/                   what many rasters make together)";

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
    for (const TileShape& shape : shapes) list.push_back(json_with_bytes(shape, type));
    out.write(json_text({{"code_type", to_string(type)}, {"candidates", list}}));
  } else {
    std::string text = std::string(kTableHeading) + "\n";
    for (const TileShape& shape : shapes) text += table_row(shape, type) + "\n";
    out.write(text + kTableNotes);
  }
  out.finish();
  return kExitDone;
}

int preview(ConvertCommandOptions& options) {
  if (options.convert.max_error) {
    throw Error(ErrorCode::kInvalidArgument, "what --max-error chooses is found by converting; leave it out");
  }
  const Prepared prepared = prepare(options, expand_inputs(options.inputs.names, options.inputs.recursive));
  print_plan(*prepared.source, options.convert, job_from(options.work), options.common);
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
