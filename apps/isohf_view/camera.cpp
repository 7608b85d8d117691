#include "camera.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reading/hud.h"

namespace isohf::view {
namespace {

/// Range of heights of the shorter side below which ground looks flat, and above which it towers.
constexpr double kFlat = 0.01;
constexpr double kSteep = 0.5;
constexpr double kHilly = 0.2;            ///< what ground of no known proportion is drawn with at most
constexpr double kSteepest_rad = 1.5707;  // straight down has no heading
constexpr double kStraight = 1e-6;

/// Turns a vector about an axis of length 1, counter-clockwise seen against the axis.
Vec3 turned(Vec3 v, Vec3 axis, double angle_rad) {
  const double c = std::cos(angle_rad);
  return c * v + std::sin(angle_rad) * cross(axis, v) + (1.0 - c) * dot(axis, v) * axis;
}

double whole_turn(double angle_rad) {
  return std::remainder(angle_rad, 2.0 * std::acos(-1.0));
}

}  // namespace

Vec3 Camera::forward() const {
  const double flat = std::cos(pitch_rad);
  return {flat * std::sin(heading_rad), std::sin(pitch_rad), -flat * std::cos(heading_rad)};
}

void Camera::look_at(Vec3 from, Vec3 target) {
  eye = from;
  const Vec3 way = target - from;
  const double distance = std::max(length(way), 1e-9);
  // Straight down North is up.
  heading_rad = std::hypot(way.x, way.z) > kStraight * distance ? std::atan2(way.x, -way.z) : 0.0;
  pitch_rad = std::clamp(std::asin(std::clamp(way.y / distance, -1.0, 1.0)), -kSteepest_rad, kSteepest_rad);
}

void Camera::orbit(Vec3 about, double heading_change_rad, double pitch_change_rad) {
  const double before = pitch_rad;
  pitch_rad = std::clamp(pitch_rad + pitch_change_rad, -kSteepest_rad, kSteepest_rad);
  const Vec3 tilted = turned(eye - about, right(), pitch_rad - before);
  eye = about + turned(tilted, {0.0, -1.0, 0.0}, heading_change_rad);
  heading_rad = whole_turn(heading_rad + heading_change_rad);
}

Vec3 ray_through(const Camera& camera, const ViewState& view, double x, double y) {
  const double half_y = std::tan(view.fov_y_rad / 2.0);
  const double half_x = half_y * view.width / view.height;
  const Vec3 up = cross(camera.right(), camera.forward());
  return normalised(camera.forward() + x * half_x * camera.right() + y * half_y * up);
}

std::optional<PicturePoint> project(const Camera& camera, const ViewState& view, Vec3 at) {
  const Vec3 way = at - camera.eye;
  const Vec3 up = cross(camera.right(), camera.forward());
  const double depth = dot(way, camera.forward());
  if (depth <= 1e-6 * length(way)) return std::nullopt;
  return PicturePoint{0.5 * view.width + view.focal_px() * dot(way, camera.right()) / depth,
                      0.5 * view.height - view.focal_px() * dot(way, up) / depth};
}

Camera between(const Camera& from, const Camera& to, double share) {
  Camera out;
  out.eye = from.eye + share * (to.eye - from.eye);
  out.heading_rad = whole_turn(from.heading_rad + share * whole_turn(to.heading_rad - from.heading_rad));
  out.pitch_rad = from.pitch_rad + share * (to.pitch_rad - from.pitch_rad);
  return out;
}

Camera overview_camera(const TileSource& source, const ViewState& view, Vec3* target) {
  const TileBounds whole = whole_bounds(source);
  const WorldBounds covered = source.covered();
  const double low = whole.low * view.exaggeration;
  const double high = whole.high * view.exaggeration;
  const Vec3 middle{0.5 * (covered.x0 + covered.x1), 0.5 * (low + high), 0.5 * (covered.z0 + covered.z1)};
  const Vec3 way = normalised({0.25, 0.62, 0.95});  // to the eye
  const Mat4 camera = look_along(-1.0 * way);
  const double half_y = std::tan(view.fov_y_rad / 2.0);
  const double half_x = half_y * view.width / view.height;
  // The nearest distance from which every corner lies within nine tenths of the view; then the view moves until the
  // corners lie as far from one edge as from the opposite one, and again.
  double distance = 0.0;
  std::array<double, 2> shift{};
  for (int round = 0; round < 20; ++round) {
    double nearest = 0.0;
    std::array<double, 2> most{-1e300, -1e300};
    std::array<double, 2> least{1e300, 1e300};
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 at = box_corner({covered.x0, low, covered.z0}, {covered.x1, high, covered.z1}, corner) - middle;
      for (const int axis : {0, 1}) {
        const auto a = static_cast<std::size_t>(axis);
        const double aside = camera.along(axis, at) - shift[a];
        const double along = camera.along(2, at);
        nearest = std::max(nearest, std::abs(aside) / (axis == 0 ? half_x : half_y) / 0.9 + along);
        most[a] = std::max(most[a], aside / (distance - along));
        least[a] = std::min(least[a], aside / (distance - along));
      }
    }
    distance = std::max(nearest, 1e-6);
    if (round == 0) continue;
    for (const std::size_t axis : {0, 1}) shift[axis] += 0.5 * (most[axis] + least[axis]) * distance;
  }
  const Vec3 across{camera.at(0, 0), camera.at(0, 1), camera.at(0, 2)};
  const Vec3 up{camera.at(1, 0), camera.at(1, 1), camera.at(1, 2)};
  const Vec3 pivot = middle + shift[0] * across + shift[1] * up;
  if (target != nullptr) *target = pivot;
  Camera out;
  out.look_at(pivot + distance * way, pivot);
  return out;
}

double default_exaggeration(const TileSource& source) {
  const TileBounds whole = whole_bounds(source);
  const WorldBounds covered = source.covered();
  const double side = std::min(covered.x1 - covered.x0, covered.z1 - covered.z0);
  const double share = (whole.high - whole.low) / side;
  const bool is_fine = share > kFlat && (source.is_to_scale() || share < kSteep);
  if (!(share > 0.0) || is_fine) return 1.0;
  return round_length((source.is_to_scale() ? 4.0 * kFlat : kHilly) / share);
}

double farthest_corner(const TileGrid& grid, const TileBounds& whole, Vec3 eye, double exaggeration) {
  const Vec3 low{0.0, whole.low * exaggeration, 0.0};
  const Vec3 high{grid.world_width(), whole.high * exaggeration, grid.world_height()};
  double farthest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    farthest = std::max(farthest, length(box_corner(low, high, corner) - eye));
  }
  return farthest;
}

}  // namespace isohf::view
