#include "headless.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <functional>

#include "flight_path.h"
#include "headless_context.h"
#include "isohf/base/error.h"
#include "offscreen.h"
#include "png_file.h"
#include "session.h"
#include "static_mesh.h"
#include "transition_sweep.h"
#include "verify_view.h"

namespace isohf::view {
namespace {

volatile std::sig_atomic_t interrupted = 0;

void on_interrupt(int) {
  interrupted = 1;
}

/// A text file that is checked to the last byte.
class TextFile {
 public:
  explicit TextFile(const std::string& path) : path_(path) {
    if (path.empty()) return;
    file_ = std::fopen(path.c_str(), "w");
    if (file_ == nullptr) fail();
  }
  ~TextFile() {
    if (file_ != nullptr) std::fclose(file_);
  }
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;
  void line(const std::string& text) {
    if (file_ == nullptr) return;
    if (std::fputs((text + "\n").c_str(), file_) < 0) fail();
  }
  void close() {
    if (file_ == nullptr) return;
    std::FILE* file = file_;
    file_ = nullptr;
    if (std::fclose(file) != 0) fail();
  }

 private:
  [[noreturn]] void fail() const {
    throw Error(ErrorCode::kIo, path_ + ": could not be written: " + std::strerror(errno));
  }
  std::string path_;
  std::FILE* file_ = nullptr;
};

int take_screenshot(const TileSource& source, const Options& options) {
  Session session(source, options);
  const Offscreen target(options.view.width, options.view.height, GL_RGBA8);
  session.complete_frame();
  write_png(options.screenshot, target.width(), target.height(), target.read_rgba8());
  return 0;
}

double milliseconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
}

struct FlightTotals {
  std::vector<double> frame_ms;
  std::int64_t triangles = 0;
  std::uint64_t most_bytes = 0;
  std::int64_t absent = 0;
  std::int64_t over_two_calls = 0;  ///< frames with more than two draw calls for a visible tile and pass
  std::uint64_t upload_bytes = 0;
};

void print_flight(const FlightTotals& totals, const Options& options) {
  std::vector<double> sorted = totals.frame_ms;
  std::sort(sorted.begin(), sorted.end());
  double sum = 0.0;
  for (const double ms : sorted) sum += ms;
  const auto at = [&](double share) {
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  };
  fmt::print("frames: {}, ms: mean {:.2f}, median {:.2f}, 99 % {:.2f}, worst {:.2f}\n", sorted.size(),
             sum / static_cast<double>(sorted.size()), at(0.5), at(0.99), sorted.back());
  fmt::print("triangles: {} a frame, {:.2f} million a second\n",
             grouped(totals.triangles / static_cast<std::int64_t>(sorted.size())),
             static_cast<double>(totals.triangles) / sum / 1e3);
  fmt::print("tile memory: at most {:.1f} MiB, bound {} MiB; uploaded {:.1f} MiB\n",
             static_cast<double>(totals.most_bytes) / (1 << 20), options.memory_mib,
             static_cast<double>(totals.upload_bytes) / (1 << 20));
  fmt::print("frames with more than 2 draw calls a visible tile and pass: {}\n", totals.over_two_calls);
  fmt::print("tiles in view that were not there yet, a frame: {:.2f}\n",
             static_cast<double>(totals.absent) / static_cast<double>(sorted.size()));
}

/// The rasteriser's limit, at a few places along the flight.
void print_baseline(Session& session, const std::function<void(double)>& stand, const FlightPath& path) {
  constexpr int kPlaces = 5;
  MeshSpeed sum;
  for (int i = 0; i < kPlaces; ++i) {
    stand(path.begin_s() + (path.end_s() - path.begin_s()) * (i + 0.5) / kPlaces);
    const MeshSpeed here = measure_static_mesh(session);
    sum.triangles += here.triangles;
    sum.ours_ms += here.ours_ms;
    sum.plain_ms += here.plain_ms;
  }
  const auto millions = [&](double ms) { return static_cast<double>(sum.triangles) / ms / 1e3; };
  fmt::print("standing at {} places: {} triangles a frame, {:.2f} ms, {:.2f} million a second\n", kPlaces,
             grouped(sum.triangles / kPlaces), sum.ours_ms / kPlaces, millions(sum.ours_ms));
  fmt::print("the same as a plain static mesh: {:.2f} ms, {:.2f} million a second\n", sum.plain_ms / kPlaces,
             millions(sum.plain_ms));
}

int fly(const TileSource& source, const Options& options) {
  const FlightPath path = FlightPath::read(options.flight);
  const int frames = options.frames > 0 ? options.frames : 300;
  TextFile csv(options.csv);
  csv.line(
      "frame,time_s,frame_ms,update_ms,triangles,draw_calls,passes,visible_tiles,absent_tiles,resident_tiles,"
      "missing_tiles,uploads,upload_bytes,resident_bytes,radius");
  Session session(source, options);
  const Offscreen target(options.view.width, options.view.height, GL_RGBA8);
  FlightTotals totals;
  // The flight begins with everything in reach; from then on no frame waits.
  const auto stand = [&](double time_s) {
    const Waypoint at = path.at(time_s);
    const double lift = session.view.exaggeration;
    session.camera.look_at({at.eye.x, at.eye.y * lift, at.eye.z}, {at.target.x, at.target.y * lift, at.target.z});
  };
  stand(path.begin_s());
  session.complete_frame();
  std::signal(SIGINT, on_interrupt);
  for (int frame = 0; frame < frames; ++frame) {
    if (interrupted != 0) throw Error(ErrorCode::kCancelled, "interrupted");
    const double time_s = path.begin_s() + (path.end_s() - path.begin_s()) * frame / std::max(1, frames - 1);
    stand(time_s);
    const auto begin = std::chrono::steady_clock::now();
    target.bind();
    session.frame();
    glFinish();
    const double ms = milliseconds_since(begin);
    const FrameFigures& figures = session.figures();
    const TileBoxFigures& box = session.box().figures();
    csv.line(fmt::format("{},{:.4f},{:.3f},{:.3f},{},{},{},{},{},{},{},{},{},{},{:.1f}", frame, time_s, ms,
                         box.update_ms, figures.triangles, figures.draw_calls, figures.passes, figures.visible_tiles,
                         figures.absent_tiles, box.resident_tiles, box.missing_tiles, box.uploads, box.upload_bytes,
                         box.resident_bytes, box.radius));
    totals.frame_ms.push_back(ms);
    totals.triangles += figures.triangles;
    totals.absent += figures.absent_tiles;
    totals.most_bytes = std::max(totals.most_bytes, box.resident_bytes);
    totals.upload_bytes += box.upload_bytes;
    if (figures.draw_calls > 2 * figures.visible_tiles * figures.passes) ++totals.over_two_calls;
    if (session.box().error()) throw Error(ErrorCode::kCorrupt, *session.box().error());
  }
  csv.close();
  print_flight(totals, options);
  if (options.baseline) {
    print_baseline(session, stand, path);
  }
  return 0;
}

int verify(const TileSource& source, const Options& options) {
  VerifyOptions wanted;
  std::signal(SIGINT, on_interrupt);
  wanted.progress = [](std::int64_t, std::int64_t) {
    if (interrupted != 0) throw Error(ErrorCode::kCancelled, "interrupted");
  };
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
      return fly(source, options);
    case Options::Action::kVerify:
      return verify(source, options);
    default:
      return sweep(source, options);
  }
}

}  // namespace isohf::view
