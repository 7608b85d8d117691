#include "isohf/convert/elevation_range.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace isohf {

double overshoot(const Kernel& kernel, const Prefilter& prefilter) {
  const bool positive = kernel.filter() == Filter::kNearest || kernel.filter() == Filter::kBilinear;
  if (positive && prefilter.is_identity()) return 0.0;
  constexpr int kPlaces = 256;
  const std::vector<double>& response = prefilter.impulse_response();
  const int halo = prefilter.halo();
  double lebesgue = 1.0;
  for (int place = 0; place <= kPlaces; ++place) {
    const TapWeights at = kernel.at(static_cast<double>(place) / kPlaces);
    // Weight of sample k: the kernel's taps spread by the prefilter's impulse response.
    std::vector<double> weights(static_cast<std::size_t>(kernel.taps() + 2 * halo), 0.0);
    for (int tap = 0; tap < kernel.taps(); ++tap) {
      for (int j = -halo; j <= halo; ++j) {
        weights[static_cast<std::size_t>(tap + j + halo)] +=
            double{at.weights[static_cast<std::size_t>(tap)]} * response[static_cast<std::size_t>(std::abs(j))];
      }
    }
    double sum = 0.0;
    for (const double weight : weights) sum += std::abs(weight);
    lebesgue = std::max(lebesgue, sum);
  }
  lebesgue *= 1.01;
  return (lebesgue * lebesgue - 1.0) / 2.0;
}

ElevationRange widened(const ElevationRange& range, double fraction) {
  const double margin = (range.max - range.min) * fraction;
  return {range.min - margin, range.max + margin};
}

}  // namespace isohf
