#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>
#include <optional>
#include <sstream>

#include "actions.h"
#include "formats/write/raster_sink.h"
#include "gl/offscreen.h"
#include "isohf/base/output_file.h"
#include "isohf/error.h"
#include "measure/flight_path.h"
#include "options/describe.h"
#include "output/output_file.h"
#include "output/svg_chart.h"
#include "session.h"

namespace isohf::view {
namespace {

using nlohmann::ordered_json;

/// What the operating system says of this process, bytes; zeros where it says nothing.
struct ProcessMemory {
  std::uint64_t anonymous = 0;  ///< resident and its own: not to be had from a file again
  std::uint64_t peak = 0;       ///< most that was ever resident, pages of mapped files included
};

ProcessMemory process_memory() {
  ProcessMemory memory;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    std::istringstream fields(line);
    std::string name;
    std::uint64_t kib = 0;
    if (!(fields >> name >> kib)) continue;
    if (name == "RssAnon:") memory.anonymous = kib << 10U;
    if (name == "VmHWM:") memory.peak = kib << 10U;
  }
  return memory;
}

/// A file of lines that is written as the flight goes on, where it is asked for. Errors name it.
class Lines {
 public:
  explicit Lines(const std::string& path) {
    if (!path.empty()) file_.emplace(path, OutputFile::Options{.overwrite = true});
  }
  void add(const std::string& line) {
    named([&] { file_->append(line + "\n"); });
  }
  void finish() {
    named([&] { file_->commit(); });
  }

 private:
  template <typename Write>
  void named(const Write& write) {
    if (!file_) return;
    try {
      write();
    } catch (const Error& error) {
      throw error.within(file_->path());
    }
  }
  std::optional<OutputFile> file_;
};

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
  std::vector<double> time_s;
  std::vector<double> update_ms;
  std::uint64_t anonymous_before = 0;  ///< of the process, before there were tiles
  std::uint64_t most_anonymous = 0;
};

double mib(std::uint64_t bytes) {
  return static_cast<double>(bytes) / (1 << 20);
}

/// What a flight's figures come down to.
struct FlightSummary {
  std::size_t frames = 0;
  double mean_ms = 0.0;
  double median_ms = 0.0;
  double percentile_99_ms = 0.0;
  double worst_ms = 0.0;
  double triangles_per_second = 0.0;
  double update_mean_ms = 0.0;
  double update_worst_ms = 0.0;
};

FlightSummary summary_of(const FlightTotals& totals) {
  std::vector<double> sorted = totals.frame_ms;
  std::sort(sorted.begin(), sorted.end());
  const auto frames = static_cast<double>(sorted.size());
  const auto at = [&](double share) { return sorted[static_cast<std::size_t>(share * (frames - 1.0))]; };
  const auto sum_of = [](const std::vector<double>& ms) { return std::accumulate(ms.begin(), ms.end(), 0.0); };
  const double sum_ms = sum_of(sorted);
  return {.frames = sorted.size(),
          .mean_ms = sum_ms / frames,
          .median_ms = at(0.5),
          .percentile_99_ms = at(0.99),
          .worst_ms = sorted.back(),
          .triangles_per_second = static_cast<double>(totals.triangles) / sum_ms * 1e3,
          .update_mean_ms = sum_of(totals.update_ms) / frames,
          .update_worst_ms = *std::max_element(totals.update_ms.begin(), totals.update_ms.end())};
}

std::string text_from(const FlightTotals& totals, const Options& options) {
  const FlightSummary summary = summary_of(totals);
  const auto frames = static_cast<std::int64_t>(summary.frames);
  return fmt::format(
      "driver: {}\n"
      "frames: {}, ms: mean {:.2f}, median {:.2f}, 99 % {:.2f}, worst {:.2f}\n"
      "triangles: {} a frame, {:.2f} million a second\n"
      "tile memory: at most {:.1f} MiB, bound {} MiB; uploaded {:.1f} MiB\n"
      "update(), all that a frame does for paging: ms: mean {:.3f}, worst {:.3f}\n"
      "process: {:.1f} MiB of its own before the first tile, {:.1f} MiB at most; peak with mapped files {:.1f} MiB\n"
      "frames with more than 2 draw calls a visible tile and pass: {}\n"
      "tiles in view that were not there yet, a frame: {:.2f}\n",
      driver_name(), frames, summary.mean_ms, summary.median_ms, summary.percentile_99_ms, summary.worst_ms,
      cli::describe_count(totals.triangles / frames), summary.triangles_per_second / 1e6, mib(totals.most_bytes),
      options.memory_mib, mib(totals.upload_bytes), summary.update_mean_ms, summary.update_worst_ms,
      mib(totals.anonymous_before), mib(totals.most_anonymous), mib(process_memory().peak), totals.over_two_calls,
      static_cast<double>(totals.absent) / static_cast<double>(frames));
}

ordered_json json_from(const FlightTotals& totals, const Options& options) {
  const FlightSummary summary = summary_of(totals);
  return {{"archive", options.archives[0]},
          {"driver", driver_name()},
          {"frames", summary.frames},
          {"mean_ms", summary.mean_ms},
          {"median_ms", summary.median_ms},
          {"percentile_99_ms", summary.percentile_99_ms},
          {"worst_ms", summary.worst_ms},
          {"triangles", totals.triangles},
          {"triangles_per_second", summary.triangles_per_second},
          {"tile_memory_bytes", totals.most_bytes},
          {"tile_memory_bound_bytes", options.memory_mib << 20},
          {"uploaded_bytes", totals.upload_bytes},
          {"update_mean_ms", summary.update_mean_ms},
          {"update_worst_ms", summary.update_worst_ms},
          {"process_before_bytes", totals.anonymous_before},
          {"process_most_bytes", totals.most_anonymous},
          {"frames_over_two_draw_calls", totals.over_two_calls},
          {"absent_tiles", totals.absent}};
}

/// Frame times along the flight, a few frames a point, as SVG.
std::string plot_of(const FlightTotals& totals, const std::string& title) {
  constexpr std::size_t kPoints = 60;
  const std::size_t frames = totals.frame_ms.size();
  const std::size_t together = (frames + kPoints - 1) / kPoints;
  chart::Chart drawing;
  drawing.title = title;
  drawing.x_label = "seconds along the flight";
  drawing.y_label = "milliseconds";
  drawing.note = fmt::format("{} frames, {} a point; update() is all that a frame does for paging", frames, together);
  drawing.curves = {{"frame, worst", "#b03a2e", true, {}, {}},
                    {"frame, mean", "#b03a2e", false, {}, {}},
                    {"update(), worst", "#1f618d", true, {}, {}},
                    {"update(), mean", "#1f618d", false, {}, {}}};
  for (std::size_t first = 0; first < frames; first += together) {
    const std::size_t last = std::min(frames, first + together);
    const auto add = [&](const std::vector<double>& ms, std::size_t curve) {
      const auto from = ms.begin() + static_cast<std::ptrdiff_t>(first);
      const auto to = ms.begin() + static_cast<std::ptrdiff_t>(last);
      constexpr double kLeast_ms = 1e-3;  // the axis is logarithmic
      const double mean = std::accumulate(from, to, 0.0) / static_cast<double>(last - first);
      drawing.curves[curve].y.push_back(std::max(kLeast_ms, *std::max_element(from, to)));
      drawing.curves[curve + 1].y.push_back(std::max(kLeast_ms, mean));
    };
    add(totals.frame_ms, 0);
    add(totals.update_ms, 2);
    for (chart::Curve& curve : drawing.curves) curve.x.push_back(totals.time_s[first]);
  }
  return chart::line_chart(drawing, chart::Scale::kLogarithmic);
}

/// The same picture's triangles, drawn twice.
struct MeshSpeed {
  std::int64_t triangles = 0;  ///< a frame
  struct Time {
    double wall_ms = 0.0;
    double processor_ms = 0.0;  ///< of all threads: hardly depends on what else the machine does
  };
  Time ours;   ///< a whole frame of the session, nothing left to load
  Time plain;  ///< the same meshes from float positions, in one plain colour, without sky or fading
};

/// So many frames at least, and for so long: a GPU that rested takes a while to run at full speed.
constexpr int kRuns = 5;
constexpr double kRuns_ms = 500.0;

constexpr const char* kVertex = R"glsl(#version 330 core
layout(location = 0) in vec3 place;
uniform mat4 clip_from_eye;
void main() { gl_Position = clip_from_eye * vec4(place, 1.0); }
)glsl";

constexpr const char* kFragment = R"glsl(#version 330 core
out vec4 colour;
void main() { colour = vec4(0.6, 0.6, 0.6, 1.0); }
)glsl";

/// One tile's positions, seen from the eye.
class StaticTile {
 public:
  StaticTile(const Session& session, PlaneTile which) {
    const TileSource& source = session.source().plane(which.plane);
    const TileIndex tile = which.tile;
    const TileGrid& grid = source.grid();
    const TileShape& shape = grid.shape();
    const ViewScale scale = source.scale();
    std::vector<std::uint16_t> codes(static_cast<std::size_t>(shape.stored_vertex_count()));
    source.read(tile, codes);
    std::vector<float> places;
    places.reserve(3 * codes.size());
    for (int row = 0; row < shape.rows(); ++row) {
      for (int column = 0; column < shape.columns(); ++column) {
        const ObjectVertex at = object_from_grid(shape, GridVertex{column, row});
        const std::uint16_t code = codes[static_cast<std::size_t>(row * shape.columns() + column)];
        const WorldPoint world = grid.world_from_object(tile, {static_cast<double>(at.x), static_cast<double>(at.z)});
        const double y = (scale.offset + scale.scale * code) * session.view.exaggeration;
        places.push_back(static_cast<float>(world.x - session.view.eye.x));
        places.push_back(static_cast<float>(y - session.view.eye.y));
        places.push_back(static_cast<float>(world.z - session.view.eye.z));
      }
    }
    glBindVertexArray(array_.get());
    glBindBuffer(GL_ARRAY_BUFFER, places_.get());
    glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(places.size() * sizeof(float)), places.data(),
                 GL_STATIC_DRAW);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
    glEnableVertexAttribArray(0);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, session.shared().indices());
    glBindVertexArray(0);
  }
  void bind() const { glBindVertexArray(array_.get()); }

 private:
  VertexArray array_;
  Buffer places_;
};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <typename Draw>
MeshSpeed::Time median_time(const Draw& draw) {
  std::vector<double> wall_ms;
  std::vector<double> processor_ms;
  const auto first = std::chrono::steady_clock::now();
  for (int run = 0; run < kRuns || milliseconds_since(first) < kRuns_ms; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t begin_clock = std::clock();
    draw();
    glFinish();
    processor_ms.push_back(1e3 * static_cast<double>(std::clock() - begin_clock) / CLOCKS_PER_SEC);
    wall_ms.push_back(milliseconds_since(begin));
  }
  return {median(wall_ms), median(processor_ms)};
}

/// What a plain static mesh costs the same driver: every mesh that the session's frame draws, strip by strip and at the
/// same places, but with its vertices' positions laid out beforehand, and no light. Loads all tiles in reach first.
/// Medians of a few frames.
MeshSpeed measure_static_mesh(Session& session) {
  const Offscreen target(session.view.width, session.view.height, GL_RGBA8);
  target.bind();
  session.complete_frame();
  MeshSpeed speed;
  speed.triangles = session.figures().triangles;
  speed.ours = median_time([&] { session.frame(); });

  const std::vector<DrawnMesh> meshes = session.renderer().drawn();
  std::map<std::pair<int, std::int64_t>, StaticTile> tiles;
  const auto key = [&](PlaneTile at) {
    return std::pair(at.plane, session.source().plane(at.plane).grid().flat_index(at.tile));
  };
  for (const DrawnMesh& mesh : meshes) {
    tiles.try_emplace(key(mesh.at), session, mesh.at);
  }
  const Program program("static mesh", kVertex, kFragment);
  const TerrainFrame frame = terrain_frame(session.source(), session.view);
  const SharedGeometry& shared = session.shared();
  speed.plain = median_time([&] {
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    begin_opaque_pass();
    program.use();
    glUniformMatrix4fv(program.uniform("clip_from_eye"), 1, GL_FALSE, frame.clip_from_eye.floats().data());
    for (const DrawnMesh& mesh : meshes) {
      tiles.at(key(mesh.at)).bind();
      glEnable(GL_CULL_FACE);
      shared.draw_strip(mesh.level);
      if (!shared.has_stitch(mesh.level)) continue;
      glDisable(GL_CULL_FACE);
      shared.draw_stitch(mesh.level);
    }
  });
  glBindVertexArray(0);
  return speed;
}

/// The rasteriser's limit, the sum over a few places along the flight.
constexpr int kBaselinePlaces = 5;

MeshSpeed baseline_of(Session& session, const std::function<void(double)>& stand, const FlightPath& path) {
  MeshSpeed sum;
  const auto add = [](MeshSpeed::Time& total, const MeshSpeed::Time& time) {
    total.wall_ms += time.wall_ms;
    total.processor_ms += time.processor_ms;
  };
  for (int i = 0; i < kBaselinePlaces; ++i) {
    stand(path.begin_s() + (path.end_s() - path.begin_s()) * (i + 0.5) / kBaselinePlaces);
    const MeshSpeed here = measure_static_mesh(session);
    sum.triangles += here.triangles;
    add(sum.ours, here.ours);
    add(sum.plain, here.plain);
  }
  return sum;
}

std::string text_from(const MeshSpeed& sum) {
  std::string text = fmt::format("standing at {} places: {} triangles a frame\n", kBaselinePlaces,
                                 cli::describe_count(sum.triangles / kBaselinePlaces));
  const auto add = [&](const char* name, const MeshSpeed::Time& time) {
    text += fmt::format("  {} {:.2f} ms, {:.2f} million triangles a second; processor {:.2f} ms\n", name,
                        time.wall_ms / kBaselinePlaces, static_cast<double>(sum.triangles) / time.wall_ms / 1e3,
                        time.processor_ms / kBaselinePlaces);
  };
  add("isohf-view:", sum.ours);
  add("the same as a plain static mesh:", sum.plain);
  return text;
}

ordered_json json_from(const MeshSpeed& sum) {
  const auto json = [](const MeshSpeed::Time& time) -> ordered_json {
    return {{"wall_ms", time.wall_ms / kBaselinePlaces}, {"processor_ms", time.processor_ms / kBaselinePlaces}};
  };
  return {{"places", kBaselinePlaces},
          {"triangles", sum.triangles / kBaselinePlaces},
          {"isohf_view", json(sum.ours)},
          {"static_mesh", json(sum.plain)}};
}

}  // namespace

void fly(const TileSource& source, const Options& options, const std::function<void()>& poll) {
  const FlightPath path = FlightPath::read(options.flight);
  const int frames = options.frames > 0 ? options.frames : 300;
  Lines csv(options.csv);
  csv.add(
      "frame,time_s,frame_ms,update_ms,triangles,draw_calls,passes,visible_tiles,absent_tiles,resident_tiles,"
      "missing_tiles,uploads,shadow_uploads,shadows_to_come,upload_bytes,resident_bytes,radius,texture_upload_bytes,"
      "texture_bytes,"
      "textures_to_come");
  Session session(source, options);
  session.poll = poll;
  const bool films = !options.screenshot.empty();
  const Offscreen target(options.view.width, options.view.height, GL_RGBA8, films ? options.samples.value_or(4) : 1);
  FlightTotals totals;
  totals.anonymous_before = process_memory().anonymous;
  // The flight begins with everything in reach; from then on no frame waits.
  const auto stand = [&](double time_s) {
    const Waypoint at = path.at(time_s);
    session.camera.look_at(session.from_archive(at.eye), session.from_archive(at.target));
  };
  stand(path.begin_s());
  session.complete_frame();
  for (int frame = 0; frame < frames; ++frame) {
    poll();
    const double time_s = path.begin_s() + (path.end_s() - path.begin_s()) * frame / std::max(1, frames - 1);
    stand(time_s);
    const auto begin = std::chrono::steady_clock::now();
    target.bind();
    session.frame();
    glFinish();
    const double ms = milliseconds_since(begin);
    if (films) {
      session.complete_frame();
      const std::filesystem::path name(options.screenshot);
      const std::string numbered =
          (name.parent_path() / fmt::format("{}-{:04}.png", name.stem().string(), frame + 1)).string();
      cli::check_output_file({options.archives[0]}, numbered, options.overwrite);
      check_raster_target(numbered, options.overwrite);
      session.keep(target, options, numbered);
    }
    const FrameFigures& figures = session.figures();
    const TileBoxFigures& box = session.boxes().figures();
    const TextureBoxFigures textures =
        session.textures() != nullptr ? session.textures()->figures() : TextureBoxFigures{};
    const double update_ms = box.update_ms + textures.update_ms;
    csv.add(fmt::format("{},{:.4f},{:.3f},{:.3f},{},{},{},{},{},{},{},{},{},{},{},{},{:.1f},{},{},{}", frame, time_s,
                        ms, update_ms, figures.triangles, figures.draw_calls, figures.passes, figures.visible_tiles,
                        figures.absent_tiles, box.resident_tiles, box.missing_tiles, box.uploads, box.shadow_uploads,
                        box.shadows_to_come, box.upload_bytes, box.resident_bytes, box.radius, textures.upload_bytes,
                        textures.resident_bytes, textures.to_come));
    totals.frame_ms.push_back(ms);
    totals.time_s.push_back(time_s);
    totals.update_ms.push_back(update_ms);
    totals.most_anonymous = std::max(totals.most_anonymous, process_memory().anonymous);
    totals.triangles += figures.triangles;
    totals.absent += figures.absent_tiles;
    totals.most_bytes = std::max(totals.most_bytes, box.resident_bytes + textures.resident_bytes);
    totals.upload_bytes += box.upload_bytes + textures.upload_bytes;
    if (figures.draw_calls > 2 * figures.visible_tiles * figures.passes) ++totals.over_two_calls;
    if (session.boxes().error()) throw Error(ErrorCode::kCorrupt, *session.boxes().error());
    if (session.textures() != nullptr && session.textures()->error()) {
      throw Error(ErrorCode::kCorrupt, *session.textures()->error());
    }
  }
  csv.finish();
  if (!options.plot.empty()) {
    const std::string title = fmt::format("Flight over {} tiles, {} x {} pixels", source.grid().tile_count(),
                                          options.view.width, options.view.height);
    write_output(options.plot, plot_of(totals, title) + "\n", true);
  }
  std::optional<MeshSpeed> baseline;
  if (options.baseline) baseline = baseline_of(session, stand, path);
  print_result(options.common, text_from(totals, options) + (baseline ? text_from(*baseline) : ""), [&] {
    ordered_json document = json_from(totals, options);
    if (baseline) document["baseline"] = json_from(*baseline);
    return document;
  });
}

}  // namespace isohf::view
