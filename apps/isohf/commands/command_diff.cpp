/// isohf diff: compares two archives.

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "commands/command.h"
#include "formats/write/archive_raster.h"
#include "formats/write/raster_sink.h"
#include "isohf/error.h"
#include "isohf/parts.h"
#include "isohf/restore/raster/sample_store.h"
#include "open_archive.h"
#include "options/command_line.h"
#include "options/describe.h"
#include "options/work_options.h"
#include "output/output_kinds.h"
#include "output/report.h"

namespace isohf::cli {
namespace {

constexpr const char* kDiffFooter =
    R"(Tiles are compared by the digests that the archives state; none is decoded. Exit code 3 means that something
differs, metadata about the run (producer, effort, sizes) included.

Examples:
  isohf diff old.isohf new.isohf
  isohf diff old.isohf new.isohf --surface             by how much the elevations differ
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

void add_metadata(Report& report, const std::vector<ArchiveDifference::Member>& members) {
  ordered_json list = ordered_json::array();
  const auto value = [](const std::string& text) { return text.empty() ? ordered_json() : ordered_json::parse(text); };
  const auto shown = [](const std::string& text) { return text.empty() ? "nothing" : text; };
  std::string names;  // of the document's members
  std::string last;
  for (const auto& member : members) {
    list.push_back({{"name", member.name}, {"first", value(member.first)}, {"second", value(member.second)}});
    const std::string top = member.name.substr(0, member.name.find('/', 1));
    if (std::exchange(last, top) != top) names += (names.empty() ? "" : ", ") + top;
    report.detail("", fmt::format("{}: {}, then {}", member.name, shown(member.first), shown(member.second)));
  }
  report.add("metadata", list, "metadata",
             members.empty() ? "" : fmt::format("{} members differ, in {}; -v prints them", members.size(), names));
}

void add_tiles(Report& report, const ArchiveDifference& found) {
  report.add("tiles_compared", found.tiles_same + found.tiles_differing);
  report.add("tiles_same", found.tiles_same);
  report.add("tiles_differing", found.tiles_differing);
  report.add("only_in_first", found.only_first);
  report.add("only_in_second", found.only_second);
  ordered_json tiles = ordered_json::array();
  for (const TileIndex& tile : found.first_few) tiles.push_back({tile.column, tile.row});
  report.add("differing", tiles);
  if (!found.why_other_lattice.empty()) return;
  report.line("tiles", fmt::format("{} same, {} differ", describe_count(found.tiles_same),
                                   describe_count(found.tiles_differing)));
  if (found.tiles_differing == 0) return;
  const TileRange& bounds = found.bounds;
  report.line("differing",
              fmt::format("in columns {} to {}, rows {} to {}; {} only in the first archive, {} only in the second",
                          bounds.first.column, bounds.end.column - 1, bounds.first.row, bounds.end.row - 1,
                          describe_count(found.only_first), describe_count(found.only_second)));
}

void add_surface(Report& report, const std::optional<ArchiveDifference::Surface>& surface) {
  if (!surface) return report.add("surface", nullptr);
  report.add("surface", {{"vertices", surface->compared},
                         {"voids", surface->voids},
                         {"rms", surface->rms},
                         {"mean", surface->mean},
                         {"max", surface->max},
                         {"worst_tile", {surface->worst.column, surface->worst.row}}});
  if (surface->compared + surface->voids == 0) return;
  report.line("surface", fmt::format("rms {:.6g}, mean {:.6g}, largest {:.6g} in tile ({},{})", surface->rms,
                                     surface->mean, surface->max, surface->worst.column, surface->worst.row));
  report.line("vertices", fmt::format("{} in tiles that differ, {} more are nodata in one archive",
                                      describe_count(surface->compared), describe_count(surface->voids)));
}

/// Floats if the format has them.
void write_difference(const DiffCommand& options, const Job& job) {
  const Metadata metadata = open_archive(options.archives[0]).metadata();
  const SampleGrid grid = natural_grid(metadata);
  const SampleMapping mapping{held_type(options.raster, SampleType::kFloat32), 1.0, 0.0};
  const auto nodata = usual_nodata(mapping.type);
  RowStore store({mapping, nodata, SampleStore::Clamp::kNone}, {options.raster, grid.width, "write a .tif or .exr"});
  RasterSpec spec = spec_of(metadata, grid, mapping, nodata);
  spec.overwrite = options.overwrite;
  const auto sink = create_raster(options.raster, spec);
  const auto take = [&](std::int64_t row, std::span<const double> difference) {
    sink->write_rows(store.raw_rows(row, difference));
  };
  subtract_archives(options.archives[0], options.archives[1], take, job);
  sink->finish();
}

int run(const DiffCommand& options) {
  for (const std::string& archive : options.archives) static_cast<void>(open_archive(archive));
  if (!options.raster.empty()) check_raster_output(options.archives, options.raster, options.overwrite);
  std::optional<ProgressDisplay> display(std::in_place, options.common, options.work.progress);
  const Job job = job_from(options.work, *display);
  const ArchiveDifference found = diff_archives(options.archives[0], options.archives[1], options.surface, job);
  if (!options.raster.empty()) write_difference(options, job);
  display.reset();
  Report report;
  report.add("first", options.archives[0]);
  report.add("second", options.archives[1]);
  add_metadata(report, found.metadata);
  report.add("same_lattice", found.why_other_lattice.empty());
  report.add("why_other_lattice", found.why_other_lattice, "lattice",
             found.why_other_lattice.empty() ? "" : options.archives[1] + " " + found.why_other_lattice);
  add_tiles(report, found);
  add_surface(report, found.surface);
  report.add("raster", options.raster.empty() ? ordered_json(nullptr) : ordered_json(options.raster));
  report.print(options.common);
  return found.same_tiles() && found.metadata.empty() ? kExitDone : kExitDifferences;
}

}  // namespace

Run add_diff(CLI::App& line, Common& common) {
  const auto kept = std::make_shared<DiffCommand>(DiffCommand{common});
  DiffCommand& options = *kept;
  positional(line, "FIRST", "The first archive", options.archives[0]);
  positional(line, "SECOND", "The second archive", options.archives[1]);
  line.add_flag("--surface", options.surface,
                "Decode the tiles that differ, and print by how much their elevations differ");
  option(line, "--raster", "RASTER", "Write SECOND minus FIRST on the grid of FIRST's source, as .tif, .exr, ...",
         options.raster);
  line.add_flag("--overwrite", options.overwrite, "Replace RASTER if it exists");
  add_threads_option(line, options.work.threads);
  line.footer(kDiffFooter);
  return [kept] { return run(*kept); };
}

}  // namespace isohf::cli
