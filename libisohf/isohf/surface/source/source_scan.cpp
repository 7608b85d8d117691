#include "isohf/surface/source/source_scan.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "isohf/surface/source/sample_types.h"

namespace isohf {
namespace {

/// Range of the valid raw samples.
template <typename T>
void scan(const SourceInfo& info, std::span<const std::byte> raw, SourceScan& scan) {
  using Wide = decltype(number_of(T{}));
  const std::size_t count = raw.size() / sizeof(T);
  Wide low = std::numeric_limits<Wide>::max();
  Wide high = std::numeric_limits<Wide>::lowest();
  std::int64_t valid = 0;
  const bool bounded = std::isfinite(info.valid_min) || std::isfinite(info.valid_max);
  const auto accept = [&](Wide value, bool is_valid) {
    low = is_valid && value < low ? value : low;
    high = is_valid && value > high ? value : high;
    valid += is_valid ? 1 : 0;
  };
  const auto is_number = [](Wide value) {
    if constexpr (std::is_floating_point_v<Wide>) return static_cast<bool>(std::isfinite(value));
    return true;
  };
  if (!bounded && info.void_values.size() <= 1) {
    const bool has_void = !info.void_values.empty();
    const double void_value = has_void ? info.void_values.front() : 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Wide value = number_of(stored_at<T>(raw.data() + i * sizeof(T)));
      accept(value, is_number(value) && !(has_void && static_cast<double>(value) == void_value));
    }
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      const Wide value = number_of(stored_at<T>(raw.data() + i * sizeof(T)));
      const auto number = static_cast<double>(value);
      bool is_valid = is_number(value) && number >= info.valid_min && number <= info.valid_max;
      for (const double void_value : info.void_values) is_valid = is_valid && number != void_value;
      accept(value, is_valid);
    }
  }
  scan.voids += static_cast<std::int64_t>(count) - valid;
  if (valid == 0) return;
  const double a = static_cast<double>(low) * info.z_scale + info.z_offset;
  const double b = static_cast<double>(high) * info.z_scale + info.z_offset;
  const double least = std::min(a, b);
  const double most = std::max(a, b);
  scan.range.min = scan.valid == 0 ? least : std::min(scan.range.min, least);
  scan.range.max = scan.valid == 0 ? most : std::max(scan.range.max, most);
  scan.valid += valid;
}

constexpr std::size_t kRun = 4096;  // sums of sums: rounding grows with the root of the count

/// As `sum` for integers of up to 16 bits, of which a run's sum fits 32 bits: no rounding, and vectors of them.
template <typename T>
double sum_of_small(const SourceInfo& info, std::span<const std::byte> raw) {
  const auto least = static_cast<double>(std::numeric_limits<T>::lowest());
  const auto most = static_cast<double>(std::numeric_limits<T>::max());
  if (!(info.valid_min <= most) || !(info.valid_max >= least)) return 0.0;
  const auto low = static_cast<std::int32_t>(std::ceil(std::max(info.valid_min, least)));
  const auto high = static_cast<std::int32_t>(std::floor(std::min(info.valid_max, most)));
  constexpr std::int32_t kNoSample = std::int32_t{1} << 20U;
  std::int32_t void_value = kNoSample;
  if (!info.void_values.empty()) {
    const double value = info.void_values.front();
    if (value >= least && value <= most && value == std::floor(value)) void_value = static_cast<std::int32_t>(value);
  }
  const std::size_t count = raw.size() / sizeof(T);
  double total = 0.0;
  for (std::size_t first = 0; first < count; first += kRun) {
    const std::byte* const samples = raw.data() + first * sizeof(T);
    const std::size_t in_run = std::min(kRun, count - first);
    std::int32_t run = 0;
    for (std::size_t i = 0; i < in_run; ++i) {
      const auto number = static_cast<std::int32_t>(stored_at<T>(samples + i * sizeof(T)));
      const bool is_valid = (number >= low) & (number <= high) & (number != void_value);
      run += is_valid ? number : 0;
    }
    total += run;
  }
  return total;
}

template <typename T>
double sum(const SourceInfo& info, std::span<const std::byte> raw) {
  if constexpr (std::is_integral_v<T> && sizeof(T) <= 2) {
    if (info.void_values.size() <= 1) return sum_of_small<T>(info, raw);
  }
  const std::size_t count = raw.size() / sizeof(T);
  double total = 0.0;
  for (std::size_t first = 0; first < count; first += kRun) {
    double run = 0.0;
    for (std::size_t i = first; i < std::min(first + kRun, count); ++i) {
      const auto number = static_cast<double>(number_of(stored_at<T>(raw.data() + i * sizeof(T))));
      bool is_valid = std::isfinite(number) && number >= info.valid_min && number <= info.valid_max;
      for (const double void_value : info.void_values) is_valid = is_valid && number != void_value;
      run += is_valid ? number : 0.0;
    }
    total += run;
  }
  return total;
}

}  // namespace

double sum_of_samples(const SourceInfo& info, std::span<const std::byte> raw) {
  return with_stored_type(info.sample_type, [&](auto sample) { return sum<decltype(sample)>(info, raw); });
}

void scan_samples(const SourceInfo& info, std::span<const std::byte> raw, SourceScan& found) {
  with_stored_type(info.sample_type, [&](auto sample) { scan<decltype(sample)>(info, raw, found); });
}

double choose_datum(const SourceInfo& info, const ElevationRange& range) {
  const bool wide = info.sample_type == SampleType::kUint32 || info.sample_type == SampleType::kInt32 ||
                    info.sample_type == SampleType::kFloat64;
  const bool scaled = info.z_scale != 1.0 || info.z_offset != 0.0;
  return wide || scaled ? std::round((range.min + range.max) / 2.0) : 0.0;
}

}  // namespace isohf
