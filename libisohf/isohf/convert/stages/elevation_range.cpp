#include "isohf/convert/stages/elevation_range.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace isohf {

double overshoot(const Kernel& kernel, const Prefilter& prefilter) {
  const bool stays_within =
      kernel.filter() == Filter::kNearest || kernel.filter() == Filter::kBilinear || kernel.is_limited();
  if (stays_within && prefilter.is_identity()) return 0.0;
  constexpr int kPlaces = 256;
  const std::vector<double>& response = prefilter.impulse_response();
  const auto reach = static_cast<std::int64_t>(response.size()) - 1;
  const std::int64_t taps = kernel.taps();
  // Cells at a row's end, where samples stand in for others as well, up to one that is as good as in the middle.
  const std::int64_t cells = taps + std::min<std::int64_t>(reach, 8);
  double lebesgue = 1.0;
  for (std::int64_t place = 0; place <= cells * kPlaces; ++place) {
    const TapWeights at = kernel.at(static_cast<double>(place) / kPlaces);
    // Weight of sample k: the kernel's taps spread by the prefilter's impulse response.
    std::vector<double> weights(static_cast<std::size_t>(cells + taps + 2 * reach), 0.0);
    const auto count = static_cast<std::int64_t>(weights.size()) * 2;  // the other end is far
    for (std::int64_t tap = 0; tap < taps; ++tap) {
      for (std::int64_t j = -reach; j <= reach; ++j) {
        const double weight =
            double{at.weights[static_cast<std::size_t>(tap)]} * response[static_cast<std::size_t>(std::abs(j))];
        continue_row(at.first + tap + j, count, kernel.edges(),
                     [&](std::int64_t k, int share) { weights[static_cast<std::size_t>(k)] += share * weight; });
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
