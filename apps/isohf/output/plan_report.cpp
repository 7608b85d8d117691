#include "output/plan_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "input/source_size.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/memory_plan.h"
#include "options/describe.h"
#include "output/accuracy_output.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using nlohmann::ordered_json;

ordered_json json_from_plan(const SourceInfo& info, const Plan& plan, const MemoryPlan& memory,
                            std::uint64_t bound_bytes, CodeType code_type, const ErrorEstimate& error,
                            const std::vector<std::string>& warnings) {
  const std::uint64_t raw =
      static_cast<std::uint64_t>(plan.lattice_samples) * static_cast<std::uint64_t>(raw_bytes(code_type));
  return {
      {"input",
       {{"path", info.path},
        {"format", info.format},
        {"width", info.width},
        {"height", info.height},
        {"sample_type", to_string(info.sample_type)},
        {"channel", info.channel},
        {"registration", to_string(plan.frame.registration)},
        {"spacing_x", plan.frame.spacing_x},
        {"spacing_z", plan.frame.spacing_z},
        {"in_metres", plan.frame.in_metres},
        {"warnings", info.warnings}}},
      {"shape", json_from(plan.grid.shape())},
      {"grid", json_from(plan.grid)},
      {"density", plan.density},
      {"outside", to_string(plan.outside)},
      {"projection",
       plan.frame.projection ? ordered_json::parse(format_projection(*plan.frame.projection)) : ordered_json(nullptr)},
      {"ground", plan.frame.ground ? ordered_json::parse(format_ground(*plan.frame.ground)) : ordered_json(nullptr)},
      {"wraps_x", plan.frame.wraps_x},
      {"covered", json_from(plan.frame.bounds())},
      {"lattice_samples", plan.lattice_samples},
      {"code_type", to_string(code_type)},
      {"raw_bytes", raw},
      {"estimated_archive_bytes", plan.estimated_bytes},
      {"expected_error", json_from_estimate(error)},
      {"estimated_memory_bytes", memory.bytes},
      {"least_memory_bytes", memory.least_bytes},
      {"scratch_bytes", memory.scratch_bytes},
      {"memory_bound_bytes", bound_bytes},
      {"warnings", warnings}};
}

std::string text_from_plan(const SourceInfo& info, const Plan& plan, const MemoryPlan& memory,
                           const ConvertOptions& options, const ErrorEstimate& error) {
  const CodeType code_type = options.code_type;
  const GroundRequest& ground = options.plan.ground;
  const TileGrid& grid = plan.grid;
  const TileShape& shape = grid.shape();
  const bool metres = plan.frame.in_metres;
  const WorldBounds covered = plan.frame.bounds();
  std::string text;
  const auto say = [&](const char* what, const std::string& value) { text += fmt::format("{:<12} {}\n", what, value); };
  say("input", fmt::format("{}: {}, {} x {} {}{}", info.path, info.format, info.width, info.height,
                           to_string(info.sample_type), info.channel.empty() ? "" : ", channel " + info.channel));
  say("samples", fmt::format("{} apart in x, {} in z, registered as {}", describe_length(plan.frame.spacing_x, metres),
                             describe_length(plan.frame.spacing_z, metres), to_string(plan.frame.registration)));
  say("tile shape", fmt::format("{}x{} (C x R), {} levels, aspect {:.5f}, {} triangles, {} samples", shape.columns(),
                                shape.rows(), shape.levels(), triangle_aspect(grid),
                                describe_count(shape.triangle_count()), describe_count(shape.stored_vertex_count())));
  say("tile grid", fmt::format("{} x {} = {} tiles of {} by {}", grid.tile_columns(), grid.tile_rows(),
                               describe_count(grid.tile_count()), describe_length(grid.extent_x(), metres),
                               describe_length(grid.extent_z(), metres)));
  say("lattice", fmt::format("columns {} apart, rows {}; {:.4g} samples for one of the input",
                             describe_length(2.0 * grid.sigma_x(), metres), describe_length(grid.sigma_z(), metres),
                             plan.density));
  say("covers", fmt::format("{} by {}", describe_length(grid.world_width(), metres),
                            describe_length(grid.world_height(), metres)));
  say("input lies in", fmt::format("x {:.6g}..{:.6g}, z {:.6g}..{:.6g}; beyond it: {}", covered.x0, covered.x1,
                                   covered.z0, covered.z1, to_string(plan.outside)));
  if (plan.frame.ground) say("map scale", describe_map_scale(*plan.frame.ground));
  if (!ground.why_no_map.empty()) say("map scale", "not known: " + ground.why_no_map);
  if (plan.frame.projection) say("projection", describe_projection(*plan.frame.projection));
  if (plan.frame.wraps_x) say("joins", "the East edge is the West edge");
  const std::uint64_t raw =
      static_cast<std::uint64_t>(plan.lattice_samples) * static_cast<std::uint64_t>(raw_bytes(code_type));
  say("archive", fmt::format("about {} ({} samples, {} as raw {})", describe_bytes(plan.estimated_bytes),
                             describe_count(plan.lattice_samples), describe_bytes(raw), to_string(code_type)));
  say("expected", describe_estimate(error, info.vertical_unit.empty() ? "" : " " + info.vertical_unit));
  say("memory", fmt::format("about {} while converting{}; --memory can be as small as {}", describe_bytes(memory.bytes),
                            memory.scratch_bytes == 0
                                ? ""
                                : fmt::format(", and {} of a scratch file", describe_bytes(memory.scratch_bytes)),
                            describe_bytes(memory.least_bytes)));
  return text;
}

}  // namespace

void print_plan(HeightSource& source, const ConvertOptions& options, const Job& job, const Common& common) {
  const SourceInfo& info = source.info();
  const Plan plan = make_plan(info, options.plan);
  const MemoryPlan memory = plan_memory(source, plan, options, job);
  std::vector<Warning> all = info.warnings;
  const std::vector<std::string> warnings = plan_warnings(info, plan, options.plan);
  for (const std::string& warning : warnings) all.push_back(warning);
  if (const std::string scale = scale_warning(info, plan.frame, options.plan.ground.projection); !scale.empty()) {
    all.push_back(scale);
  }
  bool is_refused = false;
  try {
    check_memory(source, plan, options, memory, job);
  } catch (const Error& refusal) {
    if (job.memory_bytes != 0) throw;  // a bound that was given
    is_refused = true;
    all.emplace_back(fmt::format("convert would refuse: {}", refusal.what()));
  }
  print_warnings(common, all);
  ErrorEstimate error;
  if (is_refused) {
    error.why_none = "the conversion would be refused";
  } else {
    error = estimate_error(source, options, job);
  }
  StandardOutput out(common);
  if (common.json) {
    out.write(json_text(json_from_plan(info, plan, memory, job.bound_bytes(), options.code_type, error, warnings)));
  } else if (!common.quiet) {
    out.write(text_from_plan(info, plan, memory, options, error));
  }
  out.finish();
}

void print_plan_notes(HeightSource& source, const ConvertOptions& options, const Job& job, const Common& common) {
  const Plan plan = make_plan(source.info(), options.plan);
  std::istringstream lines(text_from_plan(source.info(), plan, plan_memory(source, plan, options, job), options,
                                          estimate_error(source, options, job)));
  for (std::string line; std::getline(lines, line);) print_note(common, line);
}

}  // namespace isohf::cli
