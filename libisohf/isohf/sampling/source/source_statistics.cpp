#include "isohf/sampling/source/source_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

#include "isohf/base/sample.h"
#include "isohf/base/void_values.h"

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

constexpr std::array<double, 10> kMarks = {-32768.0, -32767.0, 32767.0, 65535.0,   -9999.0,
                                           9999.0,   -99999.0, 99999.0, -999999.0, 999999.0};
/// No elevation on any body is as large in any unit.
constexpr double kHuge = 1e30;

bool is_mark(double value) {
  return std::find(kMarks.begin(), kMarks.end(), value) != kMarks.end();
}

void merge(SourceScan& into, const SourceScan& part) {
  into.voids += part.voids;
  if (part.valid == 0) return;
  into.range.min = into.valid == 0 ? part.range.min : std::min(into.range.min, part.range.min);
  into.range.max = into.valid == 0 ? part.range.max : std::max(into.range.max, part.range.max);
  into.valid += part.valid;
}

}  // namespace

double sum_of_samples(const SourceInfo& info, std::span<const std::byte> raw) {
  return with_stored_type(info.sample_type, [&](auto sample) { return sum<decltype(sample)>(info, raw); });
}

void scan_samples(const SourceInfo& info, std::span<const std::byte> raw, SourceScan& found) {
  with_stored_type(info.sample_type, [&](auto sample) { scan<decltype(sample)>(info, raw, found); });
}

double choose_datum(const ElevationRange& range) {
  return std::round((range.min + range.max) / 2.0);
}

SourceSurvey::SourceSurvey(const SourceInfo& info, bool with_mean)
    : info_(info), z_scale_(info.z_scale), z_offset_(info.z_offset), with_mean_(with_mean) {
  info_.z_scale = 1.0;
  info_.z_offset = 0.0;
}

void SourceSurvey::add(std::span<const std::byte> raw) {
  SourceScan part;
  scan_samples(info_, raw, part);
  merge(all_, part);
  if (with_mean_) sum_ += sum_of_samples(info_, raw);
  look_for_voids(raw, part);
}

void SourceSurvey::add(const SourceSurvey& other) {
  merge(all_, other.all_);
  merge(others_, other.others_);
  merge(huge_negative_, other.huge_negative_);
  merge(huge_positive_, other.huge_positive_);
  for (const auto& [value, count] : other.suspects_) suspects_[value] += count;
  sum_ += other.sum_;
}

/// Takes suspects out of the part, one after the other, until its ends are none.
void SourceSurvey::look_for_voids(std::span<const std::byte> raw, SourceScan part) {
  SourceInfo without = info_;
  while (part.valid > 0) {
    const double low = part.range.min;
    const double high = part.range.max;
    const std::int64_t before = part.valid;
    std::int64_t* count = nullptr;
    if (low <= -kHuge) {
      SourceInfo only = without;
      only.valid_max = -kHuge;
      scan_samples(only, raw, huge_negative_);
      without.valid_min = std::max(without.valid_min, std::nextafter(-kHuge, 0.0));
    } else if (high >= kHuge) {
      SourceInfo only = without;
      only.valid_min = kHuge;
      scan_samples(only, raw, huge_positive_);
      without.valid_max = std::min(without.valid_max, std::nextafter(kHuge, 0.0));
    } else if (is_mark(low) || is_mark(high)) {
      const double value = is_mark(low) ? low : high;
      count = &suspects_[value];
      without.void_values.push_back(value);
    } else {
      break;
    }
    part = {};
    scan_samples(without, raw, part);
    if (count != nullptr) *count += before - part.valid;
  }
  merge(others_, part);
}

SourceScan SourceSurvey::scan() const {
  SourceScan scan = all_;
  const double a = all_.range.min * z_scale_ + z_offset_;
  const double b = all_.range.max * z_scale_ + z_offset_;
  scan.range = {std::min(a, b), std::max(a, b)};
  return scan;
}

std::optional<double> SourceSurvey::mean() const {
  if (!with_mean_ || all_.valid == 0) return std::nullopt;
  return sum_ / static_cast<double>(all_.valid) * z_scale_ + z_offset_;
}

std::vector<UndeclaredVoid> SourceSurvey::undeclared_voids() const {
  std::vector<UndeclaredVoid> found;
  if (others_.valid == 0) return found;
  const auto add_huge = [&](const SourceScan& huge, double value) {
    if (huge.valid > 0) found.push_back({value, huge.valid, huge.range.min != huge.range.max});
  };
  add_huge(huge_negative_, huge_negative_.range.min);
  // Suspects that lie among the rest are part of it, the nearest first.
  ElevationRange rest = others_.range;
  std::vector<std::pair<double, std::int64_t>> suspects(suspects_.begin(), suspects_.end());
  const auto distance = [&](double value) { return std::max(rest.min - value, value - rest.max); };
  std::sort(suspects.begin(), suspects.end(),
            [&](const auto& a, const auto& b) { return distance(a.first) < distance(b.first); });
  for (const auto& [value, count] : suspects) {
    if (distance(value) > std::max(rest.max - rest.min, 1.0)) {
      found.push_back({value, count, false});
    } else {
      rest = {std::min(rest.min, value), std::max(rest.max, value)};
    }
  }
  add_huge(huge_positive_, huge_positive_.range.max);
  return found;
}

std::string SourceSurvey::warning() const {
  // A reader that counts on its own (ASCII grids, where text is parsed anyway) has said it.
  for (const Warning& warning : info_.warnings) {
    if (warning.kind == Warning::Kind::kUndeclaredNodata) return {};
  }
  std::string values;
  std::vector<double> list;
  for (const UndeclaredVoid& found : undeclared_voids()) {
    list.push_back(found.value);
    values += fmt::format("{}{} samples hold {:.9g}{}", values.empty() ? "" : ", ", found.count, found.value,
                          found.many_values ? " or the like" : "");
  }
  if (values.empty()) return {};
  return fmt::format("{}, far from all others ({:.6g} to {:.6g}): if that means no elevation, give {}", values,
                     others_.range.min, others_.range.max, void_values_with(info_, list));
}

}  // namespace isohf
