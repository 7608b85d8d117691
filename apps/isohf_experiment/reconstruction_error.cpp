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
  return *this;
}

ErrorMeter::ErrorMeter(const TestMesh& mesh, const SineWave& wave, double steepest)
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

void ErrorMeter::add_slopes(const WaveOnShape& on, const TriangleShape& shape, std::complex<double> turn,
                            const std::array<double, 3>& heights, ErrorSums& sums) const {
  const double scale = slope_of_height_ / shape.doubled_area();
  const double rise_second = heights[1] - heights[0];
  const double rise_third = heights[2] - heights[0];
  const double mesh_x = scale * (rise_second * shape.third.z - rise_third * shape.second.z);
  const double mesh_z = scale * (rise_third * shape.second.x - rise_second * shape.third.x);
  const double mesh_length = std::sqrt(1.0 + mesh_x * mesh_x + mesh_z * mesh_z);
  // Slopes along the wave, where the light stands, and across it, where the sine has none.
  const double mesh_along = mesh_x * direction_.x + mesh_z * direction_.z;
  const double mesh_across = mesh_z * direction_.x - mesh_x * direction_.z;
  const double light_up = std::sin(kLightElevation_rad);
  const double light_along = std::cos(kLightElevation_rad);
  const double mesh_light = std::max(0.0, (light_up - light_along * mesh_along) / mesh_length);

  std::array<double, kSlopePoints> angle;
  std::array<double, kSlopePoints> light;
  for (std::size_t p = 0; p < kSlopePoints; ++p) {
    const double slope = steepest_ * (turn.real() * on.slope_re[p] - turn.imag() * on.slope_im[p]);
    const double length = std::sqrt(1.0 + slope * slope);
    const double away = mesh_along - slope;
    const double twist = mesh_across * slope;
    const double sine = std::sqrt(away * away + mesh_across * mesh_across + twist * twist);
    const double cosine = 1.0 + mesh_along * slope;
    angle[p] = doubled_arctangent(sine / (mesh_length * length + cosine));  // tan of half the angle
    light[p] = std::abs(mesh_light - std::max(0.0, (light_up - light_along * slope) / length));
  }
  const double area = 0.5 * shape.doubled_area();
  for (std::size_t p = 0; p < kSlopePoints; ++p) {
    sums.normal_rad += area * slope_weight_[p] * angle[p];
    sums.shading += area * slope_weight_[p] * light[p];
  }
}

void ErrorMeter::add(const MeshTriangle& triangle, std::complex<double> turn, const std::array<double, 3>& heights,
                     ErrorSums& sums) const {
  const WaveOnShape& on = shapes_[triangle.shape];
  const TriangleShape& shape = mesh_->shapes[triangle.shape];
  const double area = 0.5 * shape.doubled_area();
  sums.area += area;
  add_elevation(on, area, turn, heights, sums);
  add_slopes(on, shape, turn, heights, sums);
}

}  // namespace isohf::experiment
