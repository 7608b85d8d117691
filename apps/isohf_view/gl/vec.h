#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace isohf::view {

/// World space: x eastwards, y up, z southwards. Right-handed.
struct Vec3 {
  double x = 0.0;
  double y = 0.0;
  double z = 0.0;

  friend Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

inline double dot(Vec3 a, Vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double length(Vec3 a) {
  return std::sqrt(dot(a, a));
}
/// The zero vector stays zero.
inline Vec3 normalised(Vec3 a) {
  const double size = length(a);
  return size > 0.0 ? (1.0 / size) * a : a;
}

/// Corner 0...7 of the box between `low` and `high`: bits 0, 1, 2 choose x, y, z.
inline Vec3 box_corner(Vec3 low, Vec3 high, int corner) {
  return {(corner & 1) != 0 ? high.x : low.x, (corner & 2) != 0 ? high.y : low.y, (corner & 4) != 0 ? high.z : low.z};
}

/// Column-major 4x4 matrix, as GL takes it.
struct Mat4 {
  std::array<double, 16> m{};

  [[nodiscard]] double at(int row, int column) const { return m[static_cast<std::size_t>(column * 4 + row)]; }
  double& at(int row, int column) { return m[static_cast<std::size_t>(column * 4 + row)]; }

  static Mat4 identity() {
    Mat4 out;
    for (int i = 0; i < 4; ++i) out.at(i, i) = 1.0;
    return out;
  }
  /// A row of the matrix times a vector, without the fourth column.
  [[nodiscard]] double along(int row, Vec3 v) const { return at(row, 0) * v.x + at(row, 1) * v.y + at(row, 2) * v.z; }
  [[nodiscard]] std::array<float, 16> floats() const {
    std::array<float, 16> out{};
    for (std::size_t i = 0; i < 16; ++i) out[i] = static_cast<float>(m[i]);
    return out;
  }
};

inline Mat4 operator*(const Mat4& a, const Mat4& b) {
  Mat4 out;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      double sum = 0.0;
      for (int k = 0; k < 4; ++k) sum += a.at(row, k) * b.at(k, column);
      out.at(row, column) = sum;
    }
  }
  return out;
}

/// Perspective projection to clip space: vertical field of view, width/height, near and far distance. Depth runs from 1
/// at the near to 0 at the far distance (glClipControl, GL_ZERO_TO_ONE), which floats hold as finely far away as near.
inline Mat4 perspective(double fov_y_rad, double aspect, double near_distance, double far_distance) {
  const double focal = 1.0 / std::tan(fov_y_rad / 2.0);
  Mat4 out;
  out.at(0, 0) = focal / aspect;
  out.at(1, 1) = focal;
  out.at(2, 2) = near_distance / (far_distance - near_distance);
  out.at(2, 3) = far_distance * near_distance / (far_distance - near_distance);
  out.at(3, 2) = -1.0;
  return out;
}

/// Rotation from world to camera axes for a viewer who looks along `forward` with +y upwards on the screen.
inline Mat4 look_along(Vec3 forward) {
  const Vec3 ahead = normalised(forward);
  Vec3 right = cross(ahead, {0.0, 1.0, 0.0});
  if (length(right) < 1e-9) right = {1.0, 0.0, 0.0};  // straight up or down: East to the right
  right = normalised(right);
  const Vec3 up = cross(right, ahead);
  Mat4 out = Mat4::identity();
  const std::array<Vec3, 3> rows{right, up, -1.0 * ahead};
  for (int row = 0; row < 3; ++row) {
    const Vec3 axis = rows[static_cast<std::size_t>(row)];
    out.at(row, 0) = axis.x;
    out.at(row, 1) = axis.y;
    out.at(row, 2) = axis.z;
  }
  return out;
}

}  // namespace isohf::view
