#include "steering.h"

#include <algorithm>
#include <cmath>

namespace isohf::view {
namespace {

constexpr double kWheelStep = 0.88;  ///< of the distance, a notch
constexpr double kTurn_rad = 2.5;    ///< by a drag as long as the picture is high
constexpr double kFlight_s = 0.45;   ///< that going somewhere takes
constexpr double kLevelSine = 0.12;  ///< below that the ground is seen too flat to be dragged along its plane
constexpr int kRowsSearched = 24;    ///< of the picture, below a cursor in the sky
constexpr int kHalvings = 16;        ///< of a turn that the ground ends
constexpr double kMostSteps = 64.0;  ///< of a frame of flight
constexpr double kClearance_m = 1.5;
constexpr double kClearanceSteps = 0.1;  ///< lattice steps, where the unit is not known

double smooth(double share) {
  return share * share * (3.0 - 2.0 * share);
}

}  // namespace

Steering::Steering(const TileSource& source, Ground& ground, Camera& camera, const ViewState& view)
    : source_(source), ground_(ground), camera_(camera), view_(view) {
  const double step = 2.0 * source.grid().sigma_x();
  clearance_ = source.is_to_scale() ? std::min(kClearance_m, 2.0 * step) : kClearanceSteps * step;
}

Vec3 Steering::ray(PicturePoint at) const {
  return ray_through(camera_, view_, 2.0 * at.x / view_.width - 1.0, 1.0 - 2.0 * at.y / view_.height);
}

std::optional<Vec3> Steering::pick(PicturePoint at) {
  return ground_.hit(camera_.eye, ray(at), view_.exaggeration);
}

Vec3 Steering::hold(PicturePoint at) {
  if (const auto there = pick(at)) return *there;
  // A cursor in the sky, or beside the data: what is seen below it, then what is seen in the middle.
  for (const double x : {at.x, 0.5 * view_.width}) {
    for (int row = 1; row <= kRowsSearched; ++row) {
      const double y = at.y + (view_.height - at.y) * row / kRowsSearched;
      if (const auto there = pick({x, y})) return *there;
    }
  }
  const WorldBounds covered = source_.covered();
  const TileBounds& whole = ground_.whole();
  return {0.5 * (covered.x0 + covered.x1), 0.5 * (whole.low + whole.high) * view_.exaggeration,
          0.5 * (covered.z0 + covered.z1)};
}

std::optional<Vec3> Steering::middle() {
  const Vec3 there = hold({0.5 * view_.width, 0.5 * view_.height});
  const auto at = project(camera_, view_, there);
  return at && at->y < view_.height ? std::optional(there) : std::nullopt;
}

/// Beside the data the ground continues at the height of its edge, so that nobody sees it from below.
double Steering::ground_under_eye() {
  const WorldBounds covered = source_.covered();
  const WorldPoint at{std::clamp(camera_.eye.x, covered.x0, covered.x1),
                      std::clamp(camera_.eye.z, covered.z0, covered.z1)};
  const double lowest = ground_.whole().low * view_.exaggeration;
  const auto highest = ground_.highest(at);
  if (!highest) return lowest;
  // High above the tile nothing needs decoding.
  if (camera_.eye.y > *highest * view_.exaggeration + 4.0 * source_.grid().extent_x()) {
    return *highest * view_.exaggeration;
  }
  const auto height = ground_.height(at);
  return height ? *height * view_.exaggeration : lowest;
}

double Steering::height_above_ground() {
  return std::max(camera_.eye.y - ground_under_eye(), clearance_);
}

void Steering::stay_above() {
  camera_.eye.y = std::max(camera_.eye.y, ground_under_eye() + clearance_);
}

void Steering::press(Drag kind, PicturePoint at) {
  flight_.reset();
  const Vec3 ground = hold(at);
  const Vec3 way = camera_.eye - ground;
  drag_ = Held{kind, at, ground, camera_, way.y > kLevelSine * length(way)};
}

void Steering::move(PicturePoint at) {
  if (!drag_) return;
  const double dx = kTurn_rad * (at.x - drag_->last.x) / view_.height;
  const double dy = kTurn_rad * (at.y - drag_->last.y) / view_.height;
  drag_->last = at;
  if (drag_->kind == Drag::kPan) {
    pan(at);
  } else {
    orbit(-dx, -dy);
  }
  stay_above();
}

void Steering::orbit(double heading_change_rad, double pitch_change_rad) {
  const Camera before = camera_;
  const double most = std::min(pitch_change_rad, std::max(-before.pitch_rad, 0.0));
  const auto is_free_after = [&](double share) {
    camera_ = before;
    camera_.orbit(drag_->ground, heading_change_rad, share * most);
    return camera_.eye.y >= ground_under_eye() + clearance_;
  };
  if (is_free_after(1.0)) return;
  double free = 0.0;
  double blocked = 1.0;
  for (int i = 0; i < kHalvings; ++i) {
    const double share = 0.5 * (free + blocked);
    (is_free_after(share) ? free : blocked) = share;
  }
  static_cast<void>(is_free_after(free));
}

void Steering::pan(PicturePoint at) {
  const Vec3 along = ray(at);
  const Vec3 way = drag_->ground - drag_->start.eye;
  if (drag_->level) {
    // At the same height, from where the cursor sees the point.
    if (along.y > -kLevelSine / 2.0) return;
    camera_.eye = drag_->ground - way.y / along.y * along;
  } else {
    const Vec3 ahead = camera_.forward();
    camera_.eye = drag_->ground - dot(way, ahead) / dot(along, ahead) * along;
  }
}

void Steering::wheel(double steps, PicturePoint at) {
  flight_.reset();
  const Vec3 ground = hold(at);
  const Vec3 way = camera_.eye - ground;
  const double distance = length(way);
  double factor = std::pow(kWheelStep, steps);
  // Never nearer than the eye may stand.
  if (steps > 0.0) factor = std::max(factor, std::min(1.0, 2.0 * clearance_ / std::max(distance, 1e-300)));
  camera_.eye = ground + factor * way;
  stay_above();
}

void Steering::approach(PicturePoint at) {
  const auto ground = pick(at);
  if (!ground) return;
  Camera target = camera_;
  const Vec3 way = camera_.eye - *ground;
  target.eye = *ground + std::max(0.3, std::min(1.0, 2.0 * clearance_ / std::max(length(way), 1e-300))) * way;
  go_to(target);
}

void Steering::go_to(const Camera& target) {
  drag_.reset();
  flight_ = Flight{camera_, target, 0.0};
}

void Steering::update(double seconds, Vec3 walk, double hurry) {
  if (flight_) {
    flight_->share = std::min(1.0, flight_->share + seconds / kFlight_s);
    camera_ = between(flight_->from, flight_->to, smooth(flight_->share));
    stay_above();
    if (flight_->share >= 1.0) flight_.reset();
  }
  if (walk == Vec3{}) return;
  flight_.reset();
  // In steps that see each ridge on the way.
  const double step = 2.0 * source_.grid().sigma_x();
  const double steps = std::clamp(std::ceil(seconds * hurry * height_above_ground() / step), 1.0, kMostSteps);
  for (int i = 0; i < static_cast<int>(steps); ++i) {
    const double way = seconds / steps * hurry * height_above_ground();
    camera_.eye = camera_.eye + way * (walk.x * camera_.right() + Vec3{0.0, walk.y, 0.0} + walk.z * camera_.forward());
    stay_above();
  }
}

}  // namespace isohf::view
