#include "reconstruction_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace isohf::experiment {
namespace {

/// 2·atan(t) for 0 <= t <= 1 within 3e-7·t: halved once more, then seven terms of the series. Vectorises, as the
/// library's function does not.
double doubled_arctangent(double t) {
  const double u = t / (1.0 + std::sqrt(1.0 + t * t));
  const double s = u * u;
  return 4.0 * u *
         (1.0 - s * (1.0 / 3 - s * (1.0 / 5 - s * (1.0 / 7 - s * (1.0 / 9 - s * (1.0 / 11 - s * (1.0 / 13)))))));
}

/// Of a normal (-along, 1, -across), along the wave and across it, that is not of unit length.
double lit(double along, double length) {
  return std::max(0.0, std::numbers::sqrt2 / 2.0 * (1.0 - along)) / length;
}

}  // namespace

Errors ErrorSums::mean() const {
  Errors errors = sums;
  for (double& error : errors) error /= area;
  errors[kRms] = std::sqrt(errors[kRms]);
  return errors;
}

ErrorMeter::ErrorMeter(const TestMesh& mesh, const SineWave& wave, double steepest)
    : mesh_(&mesh),
      shapes_(wave_on_shapes(wave, mesh)),
      direction_{std::cos(wave.angle_rad), std::sin(wave.angle_rad)},
      slope_of_height_(steepest / (2.0 * std::numbers::pi * wave.cycles_per_sample)),
      steepest_(steepest) {}

void ErrorMeter::add(const std::vector<bool>& takes, std::span<const std::complex<double>> exact,
                     std::span<const double> heights, ErrorSums& sums) const {
  for (std::size_t i = 0; i < mesh_->triangles.size(); ++i) {
    const MeshTriangle& t = mesh_->triangles[i];
    if (!takes[i] || !t.is_measured) continue;
    const WaveOnShape& on = shapes_[t.shape];
    const TriangleShape& shape = mesh_->shapes[t.shape];
    const double area = 0.5 * shape.doubled_area();
    const std::complex<double> here = exact[t.vertices[0]];
    const double first = heights[t.vertices[0]];
    const double second = heights[t.vertices[1]] - first;
    const double third = heights[t.vertices[2]] - first;
    sums.area += area;
    for (std::size_t p = 0; p < kElevationPoints; ++p) {
      const RulePoint& at = elevation_rule()[p];
      const double sine = here.real() * on.elevation[p].imag() + here.imag() * on.elevation[p].real();
      const double error = first + second * at.second + third * at.third - sine;
      sums.sums[kMean] += area * at.weight * std::abs(error);
      sums.sums[kRms] += area * at.weight * error * error;
    }
    // Slopes of the triangle's plane: along the wave, and across it, where the sine has none.
    const double scale = slope_of_height_ / shape.doubled_area();
    const double x = scale * (second * shape.third.z - third * shape.second.z);
    const double z = scale * (third * shape.second.x - second * shape.third.x);
    const double along = x * direction_.x + z * direction_.z;
    const double across = z * direction_.x - x * direction_.z;
    const double length = std::sqrt(1.0 + along * along + across * across);
    for (std::size_t p = 0; p < kSlopePoints; ++p) {
      const double weight = area * slope_rule()[p].weight;
      const double slope = steepest_ * (here.real() * on.slope[p].real() - here.imag() * on.slope[p].imag());
      const double sine_length = std::sqrt(1.0 + slope * slope);
      // The angle between two normals: half its tangent by the lengths of their product and sum.
      const double product = std::hypot(across * sine_length, slope - along);
      sums.sums[kNormal] += weight * doubled_arctangent(product / (length * sine_length + 1.0 + along * slope));
      sums.sums[kShading] += weight * std::abs(lit(along, length) - lit(slope, sine_length));
    }
  }
}

}  // namespace isohf::experiment
