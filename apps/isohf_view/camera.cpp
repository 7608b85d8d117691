#include "camera.h"

#include <algorithm>
#include <cmath>

namespace isohf::view {
namespace {

constexpr double kSteepest_rad = 1.553;  // 89 degrees: straight down has no heading

}  // namespace

Vec3 Camera::forward() const {
  const double flat = std::cos(pitch_rad);
  return {flat * std::sin(heading_rad), std::sin(pitch_rad), -flat * std::cos(heading_rad)};
}

void Camera::look_at(Vec3 from, Vec3 target) {
  eye = from;
  pivot = target;
  const Vec3 way = target - from;
  distance = std::max(length(way), 1e-9);
  if (way.x != 0.0 || way.z != 0.0) heading_rad = std::atan2(way.x, -way.z);
  pitch_rad = std::clamp(std::asin(std::clamp(way.y / distance, -1.0, 1.0)), -kSteepest_rad, kSteepest_rad);
}

void Camera::turn(double heading_change_rad, double pitch_change_rad) {
  heading_rad = std::remainder(heading_rad + heading_change_rad, 2.0 * std::acos(-1.0));
  pitch_rad = std::clamp(pitch_rad + pitch_change_rad, -kSteepest_rad, kSteepest_rad);
  if (kind == Kind::kOrbit) {
    eye = pivot - distance * forward();
  } else {
    pivot = eye + distance * forward();
  }
}

void Camera::move(double right, double up, double ahead) {
  const Vec3 east{std::cos(heading_rad), 0.0, std::sin(heading_rad)};
  const Vec3 front = kind == Kind::kFly ? forward() : Vec3{std::sin(heading_rad), 0.0, -std::cos(heading_rad)};
  const Vec3 step = right * east + Vec3{0.0, up, 0.0} + ahead * front;
  eye = eye + step;
  pivot = pivot + step;
}

void Camera::zoom(double factor) {
  if (kind == Kind::kOrbit) {
    distance *= factor;
    eye = pivot - distance * forward();
  } else {
    move(0.0, 0.0, distance * (1.0 - factor));
  }
}

void Camera::switch_kind() {
  kind = kind == Kind::kFly ? Kind::kOrbit : Kind::kFly;
  pivot = eye + distance * forward();
}

Camera overview_camera(const TileSource& source, double exaggeration) {
  const TileGrid& grid = source.grid();
  const TileBounds whole = whole_bounds(source);
  const double size = std::max(grid.world_width(), grid.world_height());
  const Vec3 middle{grid.world_width() / 2.0, 0.5 * (whole.low + whole.high) * exaggeration, grid.world_height() / 2.0};
  Camera camera;
  camera.look_at(middle + Vec3{0.25 * size, 0.62 * size, 0.95 * size}, middle);
  return camera;
}

double farthest_corner(const TileSource& source, Vec3 eye, double exaggeration) {
  const TileGrid& grid = source.grid();
  const TileBounds whole = whole_bounds(source);
  double farthest = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 place{(corner & 1) != 0 ? grid.world_width() : 0.0,
                     ((corner & 2) != 0 ? whole.high : whole.low) * exaggeration,
                     (corner & 4) != 0 ? grid.world_height() : 0.0};
    farthest = std::max(farthest, length(place - eye));
  }
  return farthest;
}

}  // namespace isohf::view
