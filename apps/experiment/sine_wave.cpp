#include "sine_wave.h"

#include <cmath>
#include <numbers>

namespace isohf::experiment {
namespace {

constexpr int kLoadParts = 8;

double turn_at(Place k, const TriangleShape& shape, const RulePoint& point) {
  const double x = point.second * shape.second.x + point.third * shape.third.x;
  const double z = point.second * shape.second.z + point.third * shape.third.z;
  return k.x * x + k.z * z;
}

std::vector<RulePoint> radon_rule() {
  const double root = std::sqrt(15.0);
  std::vector<RulePoint> rule = {{1.0 / 3.0, 1.0 / 3.0, 9.0 / 40.0}};
  for (const double sign : {-1.0, 1.0}) {
    const double near = (6.0 + sign * root) / 21.0;
    const double weight = (155.0 + sign * root) / 1200.0;
    const double far = 1.0 - 2.0 * near;
    rule.insert(rule.end(), {{near, near, weight}, {far, near, weight}, {near, far, weight}});
  }
  return rule;
}

}  // namespace

Place SineWave::wave_vector() const {
  const double k = 2.0 * std::numbers::pi * cycles_per_sample;
  return {k * std::cos(angle_rad), k * std::sin(angle_rad)};
}

std::vector<RulePoint> triangle_rule(int parts) {
  const std::vector<RulePoint> radon = radon_rule();
  const double size = 1.0 / parts;
  std::vector<RulePoint> rule;
  for (int i = 0; i < parts; ++i) {
    for (int j = 0; i + j < parts; ++j) {
      for (const RulePoint& p : radon) {
        rule.push_back({(i + p.second) * size, (j + p.third) * size, p.weight * size * size});
      }
      if (i + j + 1 == parts) continue;
      for (const RulePoint& p : radon) {  // the triangle that hangs between three of the upright ones
        rule.push_back({(i + 1 - p.second) * size, (j + 1 - p.third) * size, p.weight * size * size});
      }
    }
  }
  return rule;
}

const std::vector<RulePoint>& elevation_rule() {
  static const std::vector<RulePoint> rule = triangle_rule(2);
  return rule;
}

const std::vector<RulePoint>& slope_rule() {
  static const std::vector<RulePoint> rule = triangle_rule(1);
  return rule;
}

std::vector<WaveOnShape> wave_on_shapes(const SineWave& wave, const TestMesh& mesh) {
  static const std::vector<RulePoint> load_rule = triangle_rule(kLoadParts);
  const Place k = wave.wave_vector();
  std::vector<WaveOnShape> result;
  for (const TriangleShape& shape : mesh.shapes) {
    WaveOnShape on = {};
    for (std::size_t i = 0; i < kElevationPoints; ++i) {
      on.elevation[i] = std::polar(1.0, turn_at(k, shape, elevation_rule()[i]));
    }
    for (std::size_t i = 0; i < kSlopePoints; ++i) on.slope[i] = std::polar(1.0, turn_at(k, shape, slope_rule()[i]));
    for (const RulePoint& point : load_rule) {
      const double part = 0.5 * shape.doubled_area() * point.weight;
      const std::complex<double> value = std::polar(part, turn_at(k, shape, point));
      on.load[0] += (1.0 - point.second - point.third) * value;
      on.load[1] += point.second * value;
      on.load[2] += point.third * value;
    }
    result.push_back(on);
  }
  return result;
}

std::vector<std::complex<double>> wave_at_vertices(const SineWave& wave, const TestMesh& mesh) {
  const Place k = wave.wave_vector();
  std::vector<std::complex<double>> values;
  values.reserve(mesh.vertices.size());
  for (const Place& at : mesh.vertices) values.push_back(std::polar(1.0, k.x * at.x + k.z * at.z));
  return values;
}

}  // namespace isohf::experiment
