#include "isohf/verify/accuracy/error_statistics.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

namespace isohf {
namespace {

constexpr std::uint32_t kShift = 23 - 6;
constexpr std::size_t kBins = 0x7F800000U >> kShift;

std::size_t bin_of(double error) {
  return std::min<std::size_t>(std::bit_cast<std::uint32_t>(static_cast<float>(error)) >> kShift, kBins - 1);
}

}  // namespace

ErrorHistogram::ErrorHistogram() : counts_(kBins, 0) {}

void ErrorHistogram::add(double error) {
  ++counts_[bin_of(error)];
}

void ErrorHistogram::add(const ErrorHistogram& other) {
  for (std::size_t i = 0; i < kBins; ++i) counts_[i] += other.counts_[i];
}

double ErrorHistogram::percentile(double share) const {
  std::int64_t total = 0;
  for (const std::int64_t count : counts_) total += count;
  const auto wanted = static_cast<std::int64_t>(std::ceil(share * static_cast<double>(total)));
  std::int64_t seen = 0;
  for (std::size_t i = 0; i < kBins; ++i) {
    seen += counts_[i];
    if (seen >= wanted && seen > 0)
      return i == 0 ? 0.0 : double{std::bit_cast<float>(static_cast<std::uint32_t>(i + 1) << kShift)};
  }
  return 0.0;
}

void ErrorSums::add(const ErrorSums& later) {
  count += later.count;
  squares += later.squares;
  if (later.max > max) {
    max = later.max;
    worst = later.worst;
  }
}

double ErrorSums::rms() const {
  return count > 0 ? std::sqrt(squares / static_cast<double>(count)) : 0.0;
}

double psnr_db(double range, double rms) {
  return rms > 0.0 ? 20.0 * std::log10(range / rms) : std::numeric_limits<double>::infinity();
}

}  // namespace isohf
