#include "reconstruction_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace isohf::experiment {
namespace {

constexpr std::size_t kLanes = 4;
static_assert(kElevationPoints % kLanes == 0);

/// 2·atan(t) for 0 <= t <= 1 within 3e-7·t: halved once more, then seven terms of the series. Vectorises, as the
/// library's function does not.
inline double doubled_arctangent(double t) {
  const double u = t / (1.0 + std::sqrt(1.0 + t * t));
  const double s = u * u;
  return 4.0 * u *
         (1.0 - s * (1.0 / 3 - s * (1.0 / 5 - s * (1.0 / 7 - s * (1.0 / 9 - s * (1.0 / 11 - s * (1.0 / 13)))))));
}

}  // namespace

ErrorSums& ErrorSums::operator+=(const ErrorSums& other) {
  area += other.area;
  elevation += other.elevation;
  elevation_squared += other.elevation_squared;
  normal_rad += other.normal_rad;
  shading += other.shading;
  vertex_normal_rad += other.vertex_normal_rad;
  vertex_shading += other.vertex_shading;
  for (std::size_t i = 0; i < kAzimuths; ++i) azimuth_shading[i] += other.azimuth_shading[i];
  defect_rad += other.defect_rad;
  vertices += other.vertices;
  return *this;
}

ErrorMeter::ErrorMeter(const TestMesh& mesh, const SineWave& wave, double steepest, const Light& light)
    : mesh_(&mesh),
      shapes_(wave_on_shapes(wave, mesh)),
      direction_{std::cos(wave.angle_rad), std::sin(wave.angle_rad)},
      slope_of_height_(steepest / (2.0 * std::numbers::pi * wave.cycles_per_sample)),
      steepest_(steepest) {
  for (std::size_t i = 0; i < kElevationPoints; ++i) {
    second_[i] = elevation_rule()[i].second;
    third_[i] = elevation_rule()[i].third;
    elevation_weight_[i] = elevation_rule()[i].weight;
  }
  for (std::size_t i = 0; i < kSlopePoints; ++i) slope_weight_[i] = slope_rule()[i].weight;

  const double up = std::sin(light.elevation_rad);
  const double level = std::cos(light.elevation_rad);
  const auto put = [&](std::size_t pair, double along, double across) {
    to_light_[2 * pair] = {level * along, up, level * across};
    to_light_[2 * pair + 1] = {-level * along, up, -level * across};
  };
  // x runs East and z South.
  const auto put_azimuth = [&](std::size_t pair, double azimuth_rad) {
    const Place to = {std::sin(azimuth_rad), -std::cos(azimuth_rad)};
    put(pair, to.x * direction_.x + to.z * direction_.z, to.z * direction_.x - to.x * direction_.z);
  };
  if (light.azimuth_rad) {
    put_azimuth(0, *light.azimuth_rad);
  } else {
    put(0, 1.0, 0.0);
    to_light_[1] = to_light_[0];  // waves half a turn apart take their light with them
  }
  for (std::size_t i = 0; i < kAzimuths; ++i) put_azimuth(1 + i, std::numbers::pi * static_cast<double>(i) / kAzimuths);
}

void ErrorMeter::add_elevation(const WaveOnShape& on, double area, std::complex<double> turn,
                               const std::array<double, 3>& heights, ErrorSums& sums) const {
  const double rise_second = heights[1] - heights[0];
  const double rise_third = heights[2] - heights[0];
  std::array<double, kLanes> absolute = {};
  std::array<double, kLanes> squared = {};
  for (std::size_t i = 0; i < kElevationPoints; i += kLanes) {
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::size_t p = i + lane;
      const double sine = turn.real() * on.elevation_im[p] + turn.imag() * on.elevation_re[p];
      const double error = heights[0] + rise_second * second_[p] + rise_third * third_[p] - sine;
      absolute[lane] += elevation_weight_[p] * std::abs(error);
      squared[lane] += elevation_weight_[p] * error * error;
    }
  }
  sums.elevation += area * ((absolute[0] + absolute[1]) + (absolute[2] + absolute[3]));
  sums.elevation_squared += area * ((squared[0] + squared[1]) + (squared[2] + squared[3]));
}

Place ErrorMeter::slope_of(const TriangleShape& shape, const std::array<double, 3>& heights) const {
  const double scale = slope_of_height_ / shape.doubled_area();
  const double rise_second = heights[1] - heights[0];
  const double rise_third = heights[2] - heights[0];
  return {scale * (rise_second * shape.third.z - rise_third * shape.second.z),
          scale * (rise_third * shape.second.x - rise_second * shape.third.x)};
}

void ErrorMeter::add_slopes(const WaveOnShape& on, const TriangleShape& shape, std::complex<double> turn,
                            const std::array<double, 3>& heights, const CornerNormals& normals, ErrorSums& sums) const {
  const Place mesh = slope_of(shape, heights);
  // Slopes along the wave and across it, where the sine has none.
  const double mesh_along = mesh.x * direction_.x + mesh.z * direction_.z;
  const double mesh_across = mesh.z * direction_.x - mesh.x * direction_.z;
  const double mesh_length = std::sqrt(1.0 + mesh_along * mesh_along + mesh_across * mesh_across);
  const auto lit = [](const std::array<double, 3>& to_light, double along, double up, double across) {
    return std::max(0.0, to_light[0] * along + to_light[1] * up + to_light[2] * across);
  };
  // The angle between a normal and the sine's, (-slope, 1, 0): half its tangent by the lengths of product and sum.
  const auto angle = [](double along, double up, double across, double slope, double lengths) {
    const double turned = along + slope * up;
    const double sine = std::sqrt(across * across * (1.0 + slope * slope) + turned * turned);
    return doubled_arctangent(sine / (lengths + up - along * slope));
  };
  const double area = 0.5 * shape.doubled_area();
  for (std::size_t p = 0; p < kSlopePoints; ++p) {
    const double weight = area * slope_weight_[p];
    const double slope = steepest_ * (turn.real() * on.slope_re[p] - turn.imag() * on.slope_im[p]);
    const double length = std::sqrt(1.0 + slope * slope);
    sums.normal_rad += weight * angle(-mesh_along, 1.0, -mesh_across, slope, mesh_length * length);

    const RulePoint& at = slope_rule()[p];
    const double first = 1.0 - at.second - at.third;
    std::array<double, 3> blend = {};
    for (std::size_t i = 0; i < 3; ++i) {
      blend[i] = first * normals[0][i] + at.second * normals[1][i] + at.third * normals[2][i];
    }
    const double blend_length = std::sqrt(blend[0] * blend[0] + blend[1] * blend[1] + blend[2] * blend[2]);
    sums.vertex_normal_rad += weight * angle(blend[0], blend[1], blend[2], slope, blend_length * length);

    for (std::size_t i = 0; i < to_light_.size(); ++i) {
      const double wave_light = lit(to_light_[i], -slope, 1.0, 0.0) / length;
      const double error = std::abs(lit(to_light_[i], blend[0], blend[1], blend[2]) / blend_length - wave_light);
      if (i < 2) {
        const double face_light = lit(to_light_[i], -mesh_along, 1.0, -mesh_across) / mesh_length;
        sums.shading += 0.5 * weight * std::abs(face_light - wave_light);
        sums.vertex_shading += 0.5 * weight * error;
      } else {
        sums.azimuth_shading[i / 2 - 1] += 0.5 * weight * error;
      }
    }
  }
}

void ErrorMeter::add(const std::vector<bool>& takes, std::complex<double> turn,
                     std::span<const std::complex<double>> exact, std::span<const double> heights,
                     ErrorSums& sums) const {
  /// What the triangles around a vertex come to.
  struct Fan {
    double slope_x = 0.0;  ///< sums over triangles, by their area on the ground
    double slope_z = 0.0;
    double area = 0.0;
    double angles_rad = 0.0;
    bool is_measured = true;  ///< all of them are
  };
  std::vector<Fan> fans(mesh_->vertices.size());
  const auto corners = [&](const MeshTriangle& t) {
    return std::array<double, 3>{heights[t.vertices[0]], heights[t.vertices[1]], heights[t.vertices[2]]};
  };
  for (std::size_t i = 0; i < mesh_->triangles.size(); ++i) {
    if (!takes[i]) continue;
    const MeshTriangle& t = mesh_->triangles[i];
    const TriangleShape& shape = mesh_->shapes[t.shape];
    const std::array<double, 3> h = corners(t);
    const Place slope = slope_of(shape, h);
    const double area = 0.5 * shape.doubled_area();
    const std::array<std::array<double, 3>, 3> at = {{{0.0, slope_of_height_ * h[0], 0.0},
                                                      {shape.second.x, slope_of_height_ * h[1], shape.second.z},
                                                      {shape.third.x, slope_of_height_ * h[2], shape.third.z}}};
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const auto& here = at[corner];
      const auto& next = at[(corner + 1) % 3];
      const auto& last = at[(corner + 2) % 3];
      double dot = 0.0;
      double next_squared = 0.0;
      double last_squared = 0.0;
      for (std::size_t k = 0; k < 3; ++k) {
        dot += (next[k] - here[k]) * (last[k] - here[k]);
        next_squared += (next[k] - here[k]) * (next[k] - here[k]);
        last_squared += (last[k] - here[k]) * (last[k] - here[k]);
      }
      Fan& fan = fans[t.vertices[corner]];
      fan.slope_x += area * slope.x;
      fan.slope_z += area * slope.z;
      fan.area += area;
      fan.angles_rad += std::acos(std::clamp(dot / std::sqrt(next_squared * last_squared), -1.0, 1.0));
      fan.is_measured = fan.is_measured && t.is_measured;
    }
  }
  for (const Fan& fan : fans) {
    if (fan.area == 0.0 || !fan.is_measured) continue;
    sums.defect_rad += std::abs(2.0 * std::numbers::pi - fan.angles_rad);
    sums.vertices += 1.0;
  }
  for (std::size_t i = 0; i < mesh_->triangles.size(); ++i) {
    const MeshTriangle& t = mesh_->triangles[i];
    if (!takes[i] || !t.is_measured) continue;
    const WaveOnShape& on = shapes_[t.shape];
    const TriangleShape& shape = mesh_->shapes[t.shape];
    CornerNormals normals;
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Fan& fan = fans[t.vertices[corner]];
      const double x = fan.slope_x / fan.area;
      const double z = fan.slope_z / fan.area;
      const double length = std::sqrt(1.0 + x * x + z * z);
      normals[corner] = {-(x * direction_.x + z * direction_.z) / length, 1.0 / length,
                         -(z * direction_.x - x * direction_.z) / length};
    }
    const std::complex<double> here = turn * exact[t.vertices[0]];
    const double area = 0.5 * shape.doubled_area();
    sums.area += area;
    add_elevation(on, area, here, corners(t), sums);
    add_slopes(on, shape, here, corners(t), normals, sums);
  }
}

}  // namespace isohf::experiment
