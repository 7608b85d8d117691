#include "session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <thread>
#include <tuple>

#include "gl/offscreen.h"
#include "isohf/error.h"
#include "options/describe.h"
#include "reading/place.h"
#include "steering.h"

namespace isohf::view {
namespace {

/// Textures get two thirds of the memory.
std::uint64_t texture_bytes(const TileSource& source, const Options& options) {
  return source.textures() == nullptr ? 0 : (options.memory_mib << 20) / 3 * 2;
}

constexpr double kFromAbove_rad = -1.4;

/// Most that a frame sends to the GPU, tiles and textures together.
constexpr std::uint64_t kUploadBytes = std::uint64_t{4} << 20;

/// Four in each plane's box, and what is on its way.
constexpr std::uint64_t kTilesAtLeast = 6;

TileBoxLimits limits_from(const TileSource& source, const Options& options) {
  TileBoxLimits limits;
  limits.memory_bytes = (options.memory_mib << 20) - texture_bytes(source, options);
  limits.upload_bytes_per_frame = kUploadBytes;
  const std::uint64_t boxes = static_cast<std::uint64_t>(planes_of(source).count()) + 1;
  const std::uint64_t least = kTilesAtLeast * boxes * TileBox::most_bytes_of_a_tile(source);
  limits.enough_mib = (source.textures() == nullptr ? 1 : 3) * ((least >> 20U) + 1);
  return limits;
}

int worker_count(const Options& options) {
  const int cores = static_cast<int>(std::thread::hardware_concurrency());
  return options.threads > 0 ? options.threads : std::max(1, cores - 1);
}

constexpr double kDegree = std::numbers::pi / 180.0;
/// A sun that stands higher than this shades nothing to speak of.
constexpr double kOverhead_deg = 89.5;

SharedGeometry shared_geometry(const TileSource& source) {
  const Planes planes = planes_of(source);
  return {planes.mesh_shape(), make_index_arrays(planes.mesh_shape(), planes.count() > 0 ? planes.stride() : 0)};
}

}  // namespace

std::optional<CastingSun> casting_sun(double azimuth_deg, double elevation_deg, double exaggeration) {
  if (elevation_deg <= 0.0 || elevation_deg >= 90.0) return std::nullopt;
  const double over_true_deg = std::atan(std::tan(elevation_deg * kDegree) / exaggeration) / kDegree;
  if (std::max(elevation_deg, over_true_deg) > kOverhead_deg) return std::nullopt;
  return CastingSun{azimuth_deg, elevation_deg, exaggeration};
}

Session::Session(const TileSource& source, const Options& options)
    : view(options.view),
      sun_azimuth_deg(options.sun.azimuth_deg),
      sun_elevation_deg(options.sun.elevation_deg),
      source_(source),
      whole_(whole_bounds(source)),
      shared_(shared_geometry(source)),
      renderer_(source, shared_),
      workers_(worker_count(options)),
      boxes_(source, shared_, limits_from(source, options), workers_),
      far_distance_(options.far_distance) {
  const int levels = planes_of(source).levels();
  if (const auto& level = view.fixed_level; level && *level > levels - 1) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("--level {}: this archive has levels 0 to {}", *level, levels - 1));
  }
  view.exaggeration = options.exaggeration.value_or(default_exaggeration(source));
  if (source.textures() != nullptr) {
    // Coarse planes are drawn with one picture of all, which gets an eighth.
    std::uint64_t bytes = texture_bytes(source, options);
    if (source.planes() != nullptr) {
      texture_overview_.emplace(source, bytes / 8, workers_);
      bytes -= bytes / 8;
    }
    textures_.emplace(source, bytes, workers_);
    renderer_.set_textures(
        [this](PlaneTile at) { return at.plane == 0 ? textures_->texture(at.tile) : texture_overview_->texture(); });
    if (!options.mode) view.mode = ColourMode::kTexture;
  } else if (view.mode == ColourMode::kTexture) {
    throw Error(ErrorCode::kInvalidArgument, "--mode texture: this archive has no textures; convert with --texture");
  }
  legend_ = {{}, whole_.low / source.world_per_elevation(), whole_.high / source.world_per_elevation()};
  if (const Metadata* metadata = source.metadata()) legend_.stops = shade_colours(*metadata, options.palette);
  renderer_.set_palette(legend_.stops, legend_.low, legend_.high);
  if (options.date) begin_day(*options.date);
  Vec3 target;
  camera = overview_camera(source_, view, &target);
  if (options.position || options.look_at) {
    camera.look_at(options.position ? from_archive(*options.position) : camera.eye,
                   options.look_at ? from_archive(*options.look_at) : target);
    // Nobody asked for the turn of a view from above.
    if (!options.look_at && camera.pitch_rad < kFromAbove_rad) camera.heading_rad = 0.0;
  }
}

std::vector<ColourMode> Session::modes() const {
  std::vector<ColourMode> modes{ColourMode::kElevation, ColourMode::kLevels, ColourMode::kStrips, ColourMode::kNormals};
  if (textures_) modes.insert(modes.begin(), ColourMode::kTexture);
  return modes;
}

Vec3 Session::from_archive(Vec3 at) const {
  const WorldPoint place = source_.from_archive({at.x, at.z});
  return {place.x, at.y * view.exaggeration, place.z};
}

Vec3 Session::eye_in_archive() const {
  const WorldPoint place = source_.to_archive({camera.eye.x, camera.eye.z});
  return {place.x, camera.eye.y / view.exaggeration, place.z};
}

void Session::begin_day(const SolarTime& time) {
  if (!sky_) sky_ = source_.sky();
  if (!time_) sun_before_ = {sun_azimuth_deg, sun_elevation_deg};
  time_ = time;
  set_hours(time.hours);
}

void Session::leave_day() {
  end_day();
  std::tie(sun_azimuth_deg, sun_elevation_deg) = sun_before_;
}

void Session::set_hours(double hours) {
  time_->hours = std::clamp(hours, 0.0, 24.0);
  const SunPlace sun = sky_->sun(*time_);
  sun_azimuth_deg = sun.azimuth_deg;
  sun_elevation_deg = sun.elevation_deg;
}

void Session::prepare() {
  view.eye = camera.eye;
  view.forward = camera.forward();
  view.sun = sun_direction(sun_azimuth_deg, sun_elevation_deg);
  // Haze begins at a little more than half the far distance: by default all of the heightfield lies before it.
  const double farthest = farthest_corner(source_.grid(), whole_, camera.eye, view.exaggeration);
  view.far_distance = far_distance_ ? *far_distance_ : 1.8 * farthest;
  reach_wanted_ = std::min(view.far_distance, farthest);
  const auto sun = casting_sun(sun_azimuth_deg, sun_elevation_deg, view.exaggeration);
  view.shadows = shadows && sun;
  boxes_.set_sun(view.shadows ? sun : std::nullopt);
}

void Session::draw() {
  // Where memory has shortened the reach, haze hides its end.
  const double reach = boxes_.figures().radius;
  cut_ = reach < reach_wanted_;
  if (cut_) view.far_distance = reach;
  figures_ = renderer_.draw(view, boxes_.top(), [this](PlaneTile at) { return boxes_.resident(at); });
}

void Session::frame() {
  prepare();
  boxes_.update(view, reach_wanted_);
  if (shows_textures()) {
    const std::uint64_t gone = boxes_.figures().upload_bytes;
    textures_->update(boxes_.finest(), view, kUploadBytes > gone ? kUploadBytes - gone : 0);
    if (texture_overview_) texture_overview_->update(kUploadBytes / 4);
  }
  draw();
}

void Session::complete_frame() {
  poll();
  prepare();
  boxes_.finish(view, reach_wanted_, poll);
  if (boxes_.error()) throw Error(ErrorCode::kCorrupt, *boxes_.error());
  if (shows_textures()) {
    textures_->finish(boxes_.finest(), view, poll);
    if (textures_->error()) throw Error(ErrorCode::kCorrupt, *textures_->error());
    if (texture_overview_) {
      texture_overview_->finish(poll);
      if (texture_overview_->error()) throw Error(ErrorCode::kCorrupt, *texture_overview_->error());
    }
  }
  draw();
}

bool Session::is_settled() const {
  const TileBoxFigures& box = boxes_.figures();
  if (box.missing_tiles > 0 || box.shadows_to_come > 0) return false;
  if (!shows_textures()) return true;
  return textures_->figures().to_come == 0 && (!texture_overview_ || texture_overview_->is_whole());
}

Reading Session::reading(Figures figures, const std::optional<Vec3>& middle, double frames_per_second) const {
  Reading reading;
  if (figures == Figures::kNone) return reading;
  const TileBoxFigures& box = boxes_.figures();
  const Vec3 eye = eye_in_archive();
  std::vector<std::string>& lines = reading.figures;
  if (figures == Figures::kAll) {
    lines = {fmt::format("{:5.1f} fps   {} triangles", frames_per_second, cli::describe_count(figures_.triangles)),
             fmt::format("{} tiles drawn, {} resident, {} to come, {:.1f} MiB", figures_.visible_tiles,
                         box.resident_tiles, box.missing_tiles, static_cast<double>(box.resident_bytes) / (1 << 20)),
             fmt::format("eye at x {:.7g}  y {:.0f}  z {:.7g}", eye.x, eye.y, eye.z), driver_name()};
  }
  if (figures != Figures::kLegend) {
    lines.push_back(fmt::format("sun {:.0f}, {:.0f} deg   heights x {:.3g}   H: help", sun_azimuth_deg,
                                sun_elevation_deg, view.exaggeration));
    if (time_) {
      lines.push_back(fmt::format("{:04}-{:02}-{:02}, mean solar time", time_->year, time_->month, time_->day));
    }
    if (shows_textures() && textures_->error()) lines.push_back(*textures_->error());
    if (cut_) lines.push_back(fmt::format("far distance cut to {:.0f} by --memory", box.radius));
    if (boxes_.error()) lines.push_back(*boxes_.error());
    reading.hours = hours();
  } else if (view.exaggeration != 1.0) {
    lines.push_back(fmt::format("heights x {:.3g}", view.exaggeration));
  }
  if (view.mode == ColourMode::kElevation) reading.colours = legend_.stops;
  reading.low = legend_.low;
  reading.high = legend_.high;
  reading.height_unit = source_.height_unit();
  reading.ground_unit = source_.ground_unit();
  reading.world_per_px = middle ? true_distance(*middle) / view.focal_px() : 0.0;
  reading.heading_rad = camera.heading_rad;
  return reading;
}

void Session::keep(const Offscreen& picture, const Options& options, const std::string& path) {
  picture.bind_joined();
  if (options.legend) {
    Ground ground(source_);
    const auto middle = Steering(source_, ground, camera, view).middle();
    draw_overlay(reading(Figures::kLegend, middle, 0.0), std::max(1.0, std::min(view.width, view.height) / 720.0));
  }
  write_picture(path, picture.width(), picture.height(), options.overwrite);
}

double Session::true_distance(Vec3 at) const {
  const double distance = length(at - camera.eye);
  if (distance == 0.0) return 0.0;
  // By a hundredth of the way across the picture, which is short enough for the body to be flat.
  const double step = 0.01 * distance;
  const WorldPoint beside{at.x + step * std::cos(camera.heading_rad), at.z + step * std::sin(camera.heading_rad)};
  return distance * distance_between(source_, {at.x, at.z}, beside) / step;
}

}  // namespace isohf::view
