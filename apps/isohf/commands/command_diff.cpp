/// isohf diff: what two archives have in another way.

#include <fmt/format.h>

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands/command.h"
#include "isohf/parts.h"
#include "isohf/surface.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/work_options.h"
#include "output/json_output.h"
#include "output/output_kinds.h"
#include "output/restored_raster.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

/// "columns 0 to 39, rows 0 to 11".
std::string describe_tiles(const TileRange& tiles) {
  return fmt::format("columns {} to {}, rows {} to {}", tiles.first.column, tiles.end.column - 1, tiles.first.row,
                     tiles.end.row - 1);
}

constexpr const char* kDiffFooter =
    R"(Tiles are compared by the digests that the archives state, so that none is decoded. Exit code 3 says that something
differs: metadata that tell of the making (producer, level, sizes) count as well.

Examples:
  isohf diff old.isohf new.isohf
  isohf diff old.isohf new.isohf --surface             how far the elevations lie apart
  isohf diff old.isohf new.isohf --raster changes.tif  and where)";

struct DiffCommand {
  const Common& common;
  WorkOptions work{};
  std::vector<std::string> archives = std::vector<std::string>(2);
  bool surface = false;
  std::string raster{};
  bool overwrite = false;
};

using nlohmann::ordered_json;

ordered_json document_of(const DiffCommand& options, const ArchiveDifference& found) {
  ordered_json members = ordered_json::array();
  const auto value = [](const std::string& text) { return text.empty() ? ordered_json() : ordered_json::parse(text); };
  for (const auto& member : found.metadata) {
    members.push_back({{"name", member.name}, {"first", value(member.first)}, {"second", value(member.second)}});
  }
  ordered_json tiles = ordered_json::array();
  for (const TileIndex& tile : found.first_few) tiles.push_back({tile.column, tile.row});
  ordered_json json = {{"first", options.archives[0]},
                       {"second", options.archives[1]},
                       {"metadata", members},
                       {"same_lattice", found.why_other_lattice.empty()},
                       {"why_other_lattice", found.why_other_lattice},
                       {"tiles_compared", found.tiles_same + found.tiles_differing},
                       {"tiles_same", found.tiles_same},
                       {"tiles_differing", found.tiles_differing},
                       {"only_in_first", found.only_first},
                       {"only_in_second", found.only_second},
                       {"differing", tiles},
                       {"surface", nullptr},
                       {"raster", options.raster.empty() ? ordered_json(nullptr) : ordered_json(options.raster)}};
  if (found.surface) {
    json["surface"] = {
        {"vertices", found.surface->compared}, {"voids", found.surface->voids},
        {"rms", found.surface->rms},           {"mean", found.surface->mean},
        {"max", found.surface->max},           {"worst_tile", {found.surface->worst.column, found.surface->worst.row}}};
  }
  return json;
}

std::string text_from(const DiffCommand& options, const ArchiveDifference& found) {
  std::string text;
  const auto say = [&](const char* what, const std::string& value) { text += fmt::format("{:<12} {}\n", what, value); };
  if (!found.why_other_lattice.empty()) {
    say("lattice", fmt::format("{} {}", options.archives[1], found.why_other_lattice));
    say("metadata", fmt::format("{} members differ; --json prints them",
                                describe_count(static_cast<std::int64_t>(found.metadata.size()))));
    return text;
  }
  for (const auto& member : found.metadata) {
    const auto shown = [](const std::string& value) { return value.empty() ? "nothing" : value; };
    say("metadata", fmt::format("{}: {}, then {}", member.name, shown(member.first), shown(member.second)));
  }
  say("tiles",
      fmt::format("{} alike, {} differ{}", describe_count(found.tiles_same), describe_count(found.tiles_differing),
                  found.tiles_differing == 0
                      ? ""
                      : fmt::format(": in {}; {} in the first alone, {} in the second", describe_tiles(found.bounds),
                                    describe_count(found.only_first), describe_count(found.only_second))));
  if (found.surface && found.tiles_differing > 0) {
    const auto& surface = *found.surface;
    say("surface",
        fmt::format("rms {:.6g}, mean {:.6g}, largest {:.6g} in tile ({},{}), over {} vertices of tiles that "
                    "differ; {} void on one side",
                    surface.rms, surface.mean, surface.max, surface.worst.column, surface.worst.row,
                    describe_count(surface.compared), describe_count(surface.voids)));
  }
  return text;
}

/// Floats where the format has them.
void write_difference(const DiffCommand& options, const Job& job) {
  const Metadata metadata = open_archive(options.archives[0]).metadata();
  const SampleGrid grid = natural_grid(metadata);
  const SampleMapping mapping{restored_type(options.raster, SampleType::kFloat32), 1.0, 0.0};
  const auto void_value = usual_nodata(mapping.type);
  const SampleStore store(mapping, void_value, SampleStore::Clamp::kNone);
  const RasterTarget target{options.raster, mapping,
                            usual_remedy(options.raster, mapping, {}, RestoreMethod::kBarycentric)};
  RasterSpec spec = raster_spec(metadata, grid, mapping, void_value);
  spec.overwrite = options.overwrite;
  const auto sink = create_raster(options.raster, spec);
  SampleStore::Result counts;
  const auto take = [&](std::int64_t row, std::span<const double> difference) {
    sink->write_rows(store_rows(store, target, grid.width, row, difference, counts));
  };
  subtract_archives(options.archives[0], options.archives[1], take, job);
  sink->finish();
}

int run(const DiffCommand& options) {
  for (const std::string& archive : options.archives) (void)open_archive(archive);
  if (!options.raster.empty()) check_raster_output(options.archives, options.raster, options.overwrite);
  std::optional<ProgressDisplay> display(std::in_place, options.common, options.work.progress);
  const ArchiveDifference found =
      diff_archives(options.archives[0], options.archives[1], options.surface, job_from(options.work, *display));
  if (!options.raster.empty()) write_difference(options, job_from(options.work, *display));
  display.reset();
  StandardOutput out(options.common);
  if (options.common.json) out.write(json_text(document_of(options, found)));
  if (!options.common.json && !options.common.quiet) out.write(text_from(options, found));
  out.finish();
  return found.same_tiles() && found.metadata.empty() ? kExitDone : kExitDifferences;
}

}  // namespace

Run add_diff(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<DiffCommand>(DiffCommand{common});
  DiffCommand& options = *kept;
  positional(line, "FIRST", "The first archive", options.archives[0]);
  positional(line, "SECOND", "The second archive", options.archives[1]);
  line.add_flag("--surface", options.surface,
                "Decode the tiles that differ, and print how far their elevations differ");
  option(line, "--raster", "RASTER",
         "Write SECOND minus FIRST at the places of FIRST's source samples (.tif, .exr, ...)", options.raster);
  line.add_flag("--overwrite", options.overwrite, "Replace RASTER if it exists");
  add_threads_option(line, options.work.threads);
  line.footer(kDiffFooter);
  return [kept] { return run(*kept); };
}

}  // namespace isohf::cli
