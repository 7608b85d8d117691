#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "actions.h"
#include "formats/write/raster_sink.h"
#include "gl/offscreen.h"
#include "interrupt.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "opening.h"
#include "options/describe.h"
#include "output/output_file.h"
#include "output/progress.h"
#include "output/report.h"
#include "output/standard_output.h"
#include "program.h"
#include "session.h"
#include "verify/verify_view.h"

namespace isohf::view {
namespace {

using nlohmann::ordered_json;

/// A call that throws once the program was interrupted.
std::function<void()> interrupt_check() {
  return [&interrupted = cli::watch_interrupts()] {
    if (interrupted) throw Error(ErrorCode::kCancelled, "interrupted");
  };
}

int take_screenshot(const TileSource& source, const Options& options) {
  Session session(source, options);
  session.poll = interrupt_check();
  const Offscreen target(options.view.width, options.view.height, GL_RGBA8, kPictureSamples);
  session.complete_frame();
  glFinish();
  session.poll();
  if (session.is_cut() && !options.common.quiet) {
    cli::print_warning(
        options.common,
        fmt::format("--memory {}M holds the tiles within {:.0f} world units of the eye; what lies beyond is left out",
                    options.memory_mib, session.boxes().figures().radius));
  }
  session.keep(target, options, options.screenshot);
  cli::Report({{"archive", options.archive},
               {"screenshot", options.screenshot},
               {"driver", driver_name()},
               {"width", target.width()},
               {"height", target.height()},
               {"exaggeration", session.view.exaggeration},
               {"cut", session.is_cut()}})
      .print(options.common);
  return cli::kExitDone;
}

cli::Report report_of(const ViewReport& found, const std::string& archive) {
  cli::Report report({{"archive", archive}, {"passed", found.passed()}});
  report.add("tiles", found.tiles, "tiles",
             fmt::format("{}, {} pictures of {} pixels in all", found.tiles, cli::describe_count(found.pictures),
                         cli::describe_count(found.pixels)));
  report.add("pictures", found.pictures);
  report.add("pixels", found.pixels);
  report.add("vertices", found.vertices, "vertices",
             fmt::format("{}, {} of them shared; worst height {:.4f} codes, worst normal {:.2e}",
                         cli::describe_count(found.vertices), cli::describe_count(found.shared_vertices),
                         found.worst_height, found.worst_normal));
  report.add("shared_vertices", found.shared_vertices);
  report.add("worst_height_codes", found.worst_height);
  report.add("worst_normal", found.worst_normal);
  report.add(
      "suns_deg", found.suns_deg, "shadows",
      found.suns_deg.empty()
          ? "not looked at, as tiles are at fault"
          : fmt::format("suns of {:g} degrees, East and West; {} vertices, {} of them from seeds, worst {:.2e} of "
                        "the sun",
                        fmt::join(found.suns_deg, ", "), cli::describe_count(found.shadow_vertices),
                        cli::describe_count(found.seeded_vertices), found.worst_shadow));
  report.add("shadow_vertices", found.shadow_vertices);
  report.add("seeded_vertices", found.seeded_vertices);
  report.add("worst_shadow", found.worst_shadow);
  ordered_json rays = ordered_json::array();
  for (const ViewReport::RaySun& one : found.ray_suns) {
    rays.push_back({{"azimuth_deg", one.azimuth_deg},
                    {"elevation_deg", one.elevation_deg},
                    {"vertices", one.vertices},
                    {"dark", one.dark},
                    {"lit_though_dark", one.lit_though_dark},
                    {"dark_though_lit", one.dark_though_lit}});
    report.line("rays", fmt::format("sun at {:g},{:g}: {} of {} vertices dark, {} of these drawn lit, {} others dark",
                                    one.azimuth_deg, one.elevation_deg, cli::describe_count(one.dark),
                                    cli::describe_count(one.vertices), one.lit_though_dark, one.dark_though_lit));
  }
  report.add("rays", rays);
  report.add("failures", found.failures);
  ordered_json findings = ordered_json::array();
  for (const ViewFinding& one : found.findings) {
    findings.push_back({{"id", finding_name(one.id)},
                        {"check", check_name(one.id)},
                        {"column", one.tile.column},
                        {"row", one.tile.row},
                        {"level", one.level},
                        {"where", one.where},
                        {"worst", one.deviation},
                        {"places", one.count}});
    report.line(finding_name(one.id),
                fmt::format("{}: tile ({},{}), level {}: {}; worst {:g} at {} places", check_name(one.id),
                            one.tile.column, one.tile.row, one.level, one.where, one.deviation, one.count));
  }
  report.add("findings", findings);
  const auto not_listed = found.failures - static_cast<std::int64_t>(found.findings.size());
  if (not_listed > 0) report.line("", fmt::format("and {} more", not_listed));
  if (found.passed()) report.line("result", archive + ": archive, index arrays and shaders agree");
  return report;
}

int verify(const TileSource& source, const Options& options) {
  ViewChecks wanted;
  const TileGrid& grid = source.grid();
  if (const std::optional<isohf::TileRange>& tiles = options.tiles) {
    if (tiles->end.column > grid.tile_columns() || tiles->end.row > grid.tile_rows()) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("--tiles: the archive has {} by {} tiles", grid.tile_columns(), grid.tile_rows()));
    }
    wanted.tiles = tiles;
  }
  cli::ProgressDisplay display(options.common, cli::ProgressMode::kAuto);
  wanted.progress = [&, check = interrupt_check()](const char* what, std::int64_t done, std::int64_t all) {
    check();
    display.update(what, std::string_view(what) == "tiles" ? "tiles" : "rows", done, all);
  };
  const ViewReport report = verify_view(source, make_index_arrays(grid.shape()), wanted);
  display.clear();
  report_of(report, options.archive).print(options.common);
  return report.passed() ? cli::kExitDone : cli::kExitDifferences;
}

int run(const Options& options) {
  static_cast<void>(cli::watch_interrupts());  // from here on
  if (!options.screenshot.empty()) {
    cli::check_output_file({options.archive}, options.screenshot, options.overwrite);
    check_raster_target(options.screenshot, options.overwrite);
  }
  if (options.screenshot.empty() && !options.verify) {
    run_window(options);
    return cli::kExitDone;
  }
  const std::unique_ptr<TileSource> source = open_shown(options);
  const HeadlessContext context;
  require_gl();
  return options.verify ? verify(*source, options) : take_screenshot(*source, options);
}

cli::Run add_view(CLI::App& line, cli::Common& common) {
  const auto options = std::make_shared<Options>();
  add_options(line, *options);
  return [options, &common] {
    options->common = common;
    complete(*options);
    return run(*options);
  };
}

constexpr cli::Command kCommands[] = {{"view", "View an archive", "", add_view}};
constexpr cli::Program kView = {"isohf-view", "Explore an archive or raster in 3D, or render it to a PNG.", "",
                                kCommands};

}  // namespace
}  // namespace isohf::view

int main(int argc, char** argv) {
  if (const char* folder = std::getenv("ISOHF_MODULE_PATH"); folder != nullptr) isohf::set_module_folder(folder);
  return isohf::cli::run_main(isohf::view::kView, argc, argv);
}
