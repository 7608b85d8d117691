#include "isohf/sampling/resample/height_error.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace isohf {

double lebesgue_constant(const Kernel& kernel, const Prefilter& prefilter) {
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
        continue_row(at.first + tap + j, count,
                     [&](std::int64_t k, int share) { weights[static_cast<std::size_t>(k)] += share * weight; });
      }
    }
    double sum = 0.0;
    for (const double weight : weights) sum += std::abs(weight);
    lebesgue = std::max(lebesgue, sum);
  }
  return lebesgue * 1.01;
}

double height_error(const Kernel& kernel, const Prefilter& prefilter, const ElevationRange& range, double datum) {
  double gain = prefilter.impulse_response().front();
  for (std::size_t k = 1; k < prefilter.impulse_response().size(); ++k) {
    gain += 2.0 * std::abs(prefilter.impulse_response()[k]);
  }
  const double most = std::max(std::abs(range.min - datum), std::abs(range.max - datum));
  const double lebesgue = lebesgue_constant(kernel, Prefilter::make(Filter::kNearest, {}));
  const double squared = lebesgue * lebesgue;
  const double coefficient = prefilter.is_identity() ? most : 1.5 * most;
  const double before = prefilter.is_identity() ? most : 2.0 * gain * gain * most + coefficient;
  return 0x1p-24 * squared * (before + (2.0 * kernel.taps() + 4.0) * coefficient);
}

}  // namespace isohf
