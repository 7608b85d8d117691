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
#include "output/json_output.h"
#include "output/output_file.h"
#include "output/progress.h"
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
  print_result(options.common, "", [&] {
    return ordered_json{{"archive", options.archive}, {"screenshot", options.screenshot},
                        {"driver", driver_name()},    {"width", target.width()},
                        {"height", target.height()},  {"exaggeration", session.view.exaggeration},
                        {"cut", session.is_cut()}};
  });
  return cli::kExitDone;
}

std::string text_from(const ViewReport& report, const std::string& archive) {
  std::string text = fmt::format(
      "{} tiles, {} pictures, {} pixels, {} vertices, {} shared vertices\n"
      "worst height {:.4f} codes, worst normal {:.2e}\n",
      report.tiles, cli::describe_count(report.pictures), cli::describe_count(report.pixels),
      cli::describe_count(report.vertices), cli::describe_count(report.shared_vertices), report.worst_height,
      report.worst_normal);
  if (report.suns_deg.empty()) {
    text += "shadows: not looked at, as tiles are at fault\n";
  } else {
    text += fmt::format(
        "shadows: suns of {:g} degrees, East and West, {} vertices, {} of them from seeds, worst {:.2e} of the sun\n",
        fmt::join(report.suns_deg, ", "), cli::describe_count(report.shadow_vertices),
        cli::describe_count(report.seeded_vertices), report.worst_shadow);
  }
  if (report.passed()) return text + archive + ": archive, index arrays and shaders agree\n";
  for (const ViewFinding& found : report.findings) {
    text += fmt::format("{} {}: tile ({},{}), level {:g}: {}; worst {:g}, {} place{}\n", finding_name(found.id),
                        check_name(found.id), found.tile.column, found.tile.row, found.level, found.where,
                        found.deviation, found.count, found.count == 1 ? "" : "s");
  }
  const auto shown = static_cast<std::int64_t>(report.findings.size());
  if (report.failures > shown) text += fmt::format("and {} more\n", report.failures - shown);
  return text;
}

ordered_json json_from(const ViewReport& report, const std::string& archive) {
  ordered_json findings = ordered_json::array();
  for (const ViewFinding& found : report.findings) {
    findings.push_back({{"id", finding_name(found.id)},
                        {"check", check_name(found.id)},
                        {"column", found.tile.column},
                        {"row", found.tile.row},
                        {"level", found.level},
                        {"where", found.where},
                        {"worst", found.deviation},
                        {"places", found.count}});
  }
  return {{"archive", archive},
          {"passed", report.passed()},
          {"tiles", report.tiles},
          {"pictures", report.pictures},
          {"pixels", report.pixels},
          {"vertices", report.vertices},
          {"shared_vertices", report.shared_vertices},
          {"worst_height_codes", report.worst_height},
          {"worst_normal", report.worst_normal},
          {"suns_deg", report.suns_deg},
          {"shadow_vertices", report.shadow_vertices},
          {"seeded_vertices", report.seeded_vertices},
          {"worst_shadow", report.worst_shadow},
          {"failures", report.failures},
          {"findings", findings}};
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
  print_result(options.common, text_from(report, options.archive), [&] { return json_from(report, options.archive); });
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

void print_result(const cli::Common& common, const std::string& text, const std::function<ordered_json()>& json) {
  cli::StandardOutput out(common);
  if (common.json) {
    out.write(cli::json_text(json()));
  } else if (!common.quiet) {
    out.write(text);
  }
  out.finish();
}

}  // namespace isohf::view

int main(int argc, char** argv) {
  if (const char* folder = std::getenv("ISOHF_MODULE_PATH"); folder != nullptr) isohf::set_module_folder(folder);
  return isohf::cli::run_main(isohf::view::kView, argc, argv);
}
