#include "headless.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "gl/headless_context.h"
#include "gl/offscreen.h"
#include "gl/png_file.h"
#include "interrupt.h"
#include "isohf/error.h"
#include "measure/flight.h"
#include "measure/transition_sweep.h"
#include "output/output_file.h"
#include "output/standard_output.h"
#include "program.h"
#include "session.h"
#include "text_file.h"
#include "verify/print_result.h"
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
  const Offscreen target(options.view.width, options.view.height, GL_RGBA8);
  session.complete_frame();
  if (session.is_cut() && !options.common.quiet) {
    cli::print_warning(
        fmt::format("--memory {}M holds the tiles within {:.0f} world units of the eye; what lies beyond is left out",
                    options.memory_mib, session.box().figures().radius));
  }
  write_png(options.screenshot, target.width(), target.height(), target.read_rgba8());
  print_result(options.common, "", [&] {
    return ordered_json{{"archive", options.archive},
                        {"screenshot", options.screenshot},
                        {"width", target.width()},
                        {"height", target.height()},
                        {"cut", session.is_cut()}};
  });
  return cli::kExitDone;
}

std::string text_from(const VerifyReport& report, const std::string& archive) {
  std::string text = fmt::format(
      "{} tiles, {} pictures, {} pixels, {} vertices, {} shared vertices, {} pixels across seams\n"
      "worst height {:.4f} codes, worst normal {:.2e}\n",
      report.tiles, grouped(report.pictures), grouped(report.pixels), grouped(report.vertices),
      grouped(report.shared_vertices), grouped(report.seam_pixels), report.worst_height, report.worst_normal);
  if (report.suns_deg.empty()) {
    text += "shadows: the archive has no shadow seeds\n";
  } else {
    text += fmt::format(
        "shadows: suns of {:g} degrees, East and West, {} vertices, worst {:.4f} codes, share of the sun {:.2e}\n",
        fmt::join(report.suns_deg, ", "), grouped(report.shadow_vertices), report.worst_shadow, report.worst_share);
  }
  if (report.passed()) return text + archive + ": archive, index arrays and shaders agree\n";
  for (const Finding& finding : report.findings) {
    text += fmt::format("{}: tile ({},{}), level {:g}: {}; worst {:g}, {} place{}\n", to_string(finding.check),
                        finding.tile.column, finding.tile.row, finding.level, finding.where, finding.deviation,
                        finding.count, finding.count == 1 ? "" : "s");
  }
  const auto shown = static_cast<std::int64_t>(report.findings.size());
  if (report.failures > shown) text += fmt::format("and {} more\n", report.failures - shown);
  return text;
}

ordered_json json_from(const VerifyReport& report, const std::string& archive) {
  ordered_json findings = ordered_json::array();
  for (const Finding& finding : report.findings) {
    findings.push_back({{"check", to_string(finding.check)},
                        {"column", finding.tile.column},
                        {"row", finding.tile.row},
                        {"level", finding.level},
                        {"where", finding.where},
                        {"worst", finding.deviation},
                        {"places", finding.count}});
  }
  return {{"archive", archive},
          {"passed", report.passed()},
          {"tiles", report.tiles},
          {"pictures", report.pictures},
          {"pixels", report.pixels},
          {"vertices", report.vertices},
          {"shared_vertices", report.shared_vertices},
          {"seam_pixels", report.seam_pixels},
          {"worst_height_codes", report.worst_height},
          {"worst_normal", report.worst_normal},
          {"suns_deg", report.suns_deg},
          {"shadow_vertices", report.shadow_vertices},
          {"worst_shadow_codes", report.worst_shadow},
          {"worst_share_of_sun", report.worst_share},
          {"failures", report.failures},
          {"findings", findings}};
}

int verify(const TileSource& source, const Options& options) {
  VerifyOptions wanted;
  wanted.progress = [check = interrupt_check()](std::int64_t, std::int64_t) { check(); };
  const VerifyReport report = verify_view(source, make_index_arrays(source.grid().shape()), wanted);
  print_result(options.common, text_from(report, options.archive), [&] { return json_from(report, options.archive); });
  return report.passed() ? cli::kExitDone : cli::kExitDifferences;
}

int sweep(const TileSource& source, const Options& options) {
  TextFile csv(options.csv);
  Session session(source, options);
  const SweepResult fading = sweep_levels(session, options.sweep_steps, false);
  const SweepResult plain = sweep_levels(session, options.sweep_steps, true);
  csv.line("level,fading_largest_jump,fading_mean_jump,fading_from_start,plain_largest_jump,plain_mean_jump");
  for (std::size_t i = 0; i < fading.steps.size(); ++i) {
    const SweepStep& a = fading.steps[i];
    const SweepStep& b = plain.steps[i];
    csv.line(fmt::format("{:.5f},{},{:.5f},{:.5f},{},{:.5f}", a.level, a.largest_jump, a.mean_jump, a.from_start,
                         b.largest_jump, b.mean_jump));
  }
  csv.close();
  const std::string text = fmt::format(
      "steps: {}, levels 0 to {:g}\n"
      "fading:    largest jump of a pixel {} of 255, of the mean {:.4f}, largest retreat {:.4f}\n"
      "switching: largest jump of a pixel {} of 255, of the mean {:.4f}\n",
      options.sweep_steps, fading.steps.back().level, fading.largest_jump, fading.largest_mean_jump,
      fading.largest_retreat, plain.largest_jump, plain.largest_mean_jump);
  print_result(options.common, text, [&] {
    return ordered_json{
        {"archive", options.archive},
        {"steps", options.sweep_steps},
        {"last_level", fading.steps.back().level},
        {"fading",
         {{"largest_jump", fading.largest_jump},
          {"largest_mean_jump", fading.largest_mean_jump},
          {"largest_retreat", fading.largest_retreat}}},
        {"switching", {{"largest_jump", plain.largest_jump}, {"largest_mean_jump", plain.largest_mean_jump}}}};
  });
  return cli::kExitDone;
}

}  // namespace

void check_outputs(const Options& options) {
  for (const std::string& output : {options.screenshot, options.csv, options.plot}) {
    if (!output.empty()) cli::check_output_file({options.archive}, output, options.overwrite);
  }
}

int run_headless(const TileSource& source, const Options& options) {
  const HeadlessContext context;
  require_gl();
  switch (options.action) {
    case Options::Action::kScreenshot:
      return take_screenshot(source, options);
    case Options::Action::kFlight:
      fly(source, options, interrupt_check());
      return cli::kExitDone;
    case Options::Action::kVerify:
      return verify(source, options);
    default:
      return sweep(source, options);
  }
}

}  // namespace isohf::view
