#include "headless.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <csignal>
#include <cstdio>

#include "flight.h"
#include "headless_context.h"
#include "isohf/base/error.h"
#include "offscreen.h"
#include "png_file.h"
#include "session.h"
#include "text_file.h"
#include "transition_sweep.h"
#include "verify_view.h"

namespace isohf::view {
namespace {

volatile std::sig_atomic_t was_interrupted = 0;

void on_interrupt(int) {
  was_interrupted = 1;
}

void throw_if_interrupted() {
  if (was_interrupted != 0) throw Error(ErrorCode::kCancelled, "interrupted");
}

int take_screenshot(const TileSource& source, const Options& options) {
  Session session(source, options);
  const Offscreen target(options.view.width, options.view.height, GL_RGBA8);
  session.complete_frame();
  if (session.is_cut()) {
    std::fprintf(stderr,
                 "isohf-view: note: --memory %llu MiB hold the tiles within %.0f world units of the eye; what lies "
                 "beyond is left out\n",
                 static_cast<unsigned long long>(options.memory_mib), session.box().figures().radius);
  }
  write_png(options.screenshot, target.width(), target.height(), target.read_rgba8());
  return 0;
}

int verify(const TileSource& source, const Options& options) {
  VerifyOptions wanted;
  std::signal(SIGINT, on_interrupt);
  wanted.progress = [](std::int64_t, std::int64_t) { throw_if_interrupted(); };
  const VerifyReport report = verify_view(source, make_index_arrays(source.grid().shape()), wanted);
  fmt::print("{} tiles, {} pictures, {} pixels, {} vertices, {} shared vertices, {} pixels across seams\n",
             report.tiles, grouped(report.pictures), grouped(report.pixels), grouped(report.vertices),
             grouped(report.shared_vertices), grouped(report.seam_pixels));
  fmt::print("worst height {:.4f} codes, worst normal {:.2e}\n", report.worst_height, report.worst_normal);
  if (!report.suns_deg.empty()) {
    fmt::print(
        "shadows: suns of {:g} degrees, East and West, {} vertices, worst {:.4f} codes, share of the sun {:.2e}\n",
        fmt::join(report.suns_deg, ", "), grouped(report.shadow_vertices), report.worst_shadow, report.worst_share);
  } else {
    fmt::print("shadows: the archive has no shadow seeds\n");
  }
  if (report.passed()) {
    fmt::print("{}: archive, index arrays and shaders agree\n", options.archive);
    return 0;
  }
  for (const Finding& finding : report.findings) {
    fmt::print("{}: tile ({},{}), level {:g}: {}; worst {:g}, {} place{}\n", to_string(finding.check),
               finding.tile.column, finding.tile.row, finding.level, finding.where, finding.deviation, finding.count,
               finding.count == 1 ? "" : "s");
  }
  const auto shown = static_cast<std::int64_t>(report.findings.size());
  if (report.failures > shown) fmt::print("and {} more\n", report.failures - shown);
  return 3;
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
  fmt::print("steps: {}, levels 0 to {:g}\n", options.sweep_steps, fading.steps.back().level);
  fmt::print("fading:    largest jump of a pixel {} of 255, of the mean {:.4f}, largest retreat {:.4f}\n",
             fading.largest_jump, fading.largest_mean_jump, fading.largest_retreat);
  fmt::print("switching: largest jump of a pixel {} of 255, of the mean {:.4f}\n", plain.largest_jump,
             plain.largest_mean_jump);
  return 0;
}

}  // namespace

int run_headless(const TileSource& source, const Options& options) {
  const HeadlessContext context;
  require_gl();
  switch (options.action) {
    case Options::Action::kScreenshot:
      return take_screenshot(source, options);
    case Options::Action::kFlight:
      std::signal(SIGINT, on_interrupt);
      fly(source, options, throw_if_interrupted);
      return 0;
    case Options::Action::kVerify:
      return verify(source, options);
    default:
      return sweep(source, options);
  }
}

}  // namespace isohf::view
