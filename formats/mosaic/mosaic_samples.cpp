#include "formats/mosaic/mosaic_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <type_traits>

#include "formats/open_options.h"
#include "isohf/base/assert.h"
#include "isohf/base/sample.h"

namespace isohf {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A stored sample as a number, for loops over one type.
template <typename T>
double load(const std::byte* at) {
  return static_cast<double>(number_of(stored_at<T>(at)));
}

bool is_void(const SampleKind& kind, double number) {
  if (!std::isfinite(number) || number < kind.valid_min || number > kind.valid_max) return true;
  return std::find(kind.void_values.begin(), kind.void_values.end(), number) != kind.void_values.end();
}

struct Limits {
  double lowest = 0.0;
  double highest = 0.0;
};

/// Of an integer type; both are 0 for floating ones.
Limits limits_of(SampleType type) {
  if (is_floating(type)) return {};
  const auto [lowest, highest] = sample_range(type);
  return {lowest, highest};
}

/// Whether values are void that are not listed.
bool is_bounded(const SampleKind& kind) {
  if (std::isfinite(kind.valid_max)) return true;
  const bool is_listed = kind.void_values.size() == 1 && !is_floating(kind.type) &&
                         kind.void_values.front() == limits_of(kind.type).lowest;
  return std::isfinite(kind.valid_min) && !(is_listed && kind.valid_min == kind.void_values.front() + 1.0);
}

/// Whether some sample of this kind could be an elevation of that raw number.
bool may_hold_elevation(const SampleKind& kind, double number) {
  if (!is_floating(kind.type) && (number < limits_of(kind.type).lowest || number > limits_of(kind.type).highest))
    return false;
  return !is_void(kind, number);
}

/// The smallest type that holds all integers of [low, high]; they are those of up to 32 bits.
SampleType integer_for(double low, double high) {
  for (const SampleType type : {SampleType::kUint8, SampleType::kInt8, SampleType::kUint16, SampleType::kInt16,
                                SampleType::kUint32, SampleType::kInt32}) {
    if (low >= limits_of(type).lowest && high <= limits_of(type).highest) return type;
  }
  return SampleType::kFloat64;
}

bool has_24_bits(SampleType type) {
  return type != SampleType::kUint32 && type != SampleType::kInt32 && type != SampleType::kFloat64;
}

/// The smallest type that holds every raw sample of all kinds exactly.
SampleType common_type(const std::vector<SampleKind>& kinds, bool floating) {
  bool same = true;
  bool narrow = true;
  double low = 0.0;
  double high = 0.0;
  for (const SampleKind& kind : kinds) {
    same = same && kind.type == kinds.front().type;
    narrow = narrow && has_24_bits(kind.type);
    floating = floating || is_floating(kind.type);
    low = std::min(low, limits_of(kind.type).lowest);
    high = std::max(high, limits_of(kind.type).highest);
  }
  // float16 holds what it is given, but not what is computed between its numbers.
  if (same && (!floating || (is_floating(kinds.front().type) && kinds.front().type != SampleType::kFloat16))) {
    return kinds.front().type;
  }
  if (floating) return narrow ? SampleType::kFloat32 : SampleType::kFloat64;
  return integer_for(low, high);
}

SampleType wider(SampleType type) {
  switch (type) {
    case SampleType::kUint8:
    case SampleType::kInt8:
      return SampleType::kInt16;
    case SampleType::kUint16:
    case SampleType::kInt16:
      return SampleType::kInt32;
    default:
      return SampleType::kFloat64;
  }
}

/// A raw number that no member of an integer type has as an elevation; nullopt where none is found.
std::optional<double> common_void(const std::vector<SampleKind>& kinds, SampleType type) {
  std::vector<double> candidates;
  for (const SampleKind& kind : kinds) {
    candidates.insert(candidates.end(), kind.void_values.begin(), kind.void_values.end());
  }
  std::sort(candidates.begin(), candidates.end());
  candidates.push_back(limits_of(type).lowest);
  for (const double candidate : candidates) {
    if (!void_value_as_stored(type, candidate)) continue;
    const auto is_taken = [&](const SampleKind& kind) { return may_hold_elevation(kind, candidate); };
    if (std::none_of(kinds.begin(), kinds.end(), is_taken)) return candidate;
  }
  return std::nullopt;
}

/// The raw number to fill gaps with in a kind that stays as it is; nullopt where it has no void.
std::optional<double> gap_of(const SampleKind& kind) {
  for (const double value : kind.void_values) {
    if (std::isfinite(value)) return value;
  }
  if (is_floating(kind.type)) return kNaN;
  if (kind.valid_min > limits_of(kind.type).lowest) return limits_of(kind.type).lowest;
  if (kind.valid_max < limits_of(kind.type).highest) return limits_of(kind.type).highest;
  return std::nullopt;
}

SampleKind plain_kind(SampleType type, const SampleKind& scaled) {
  return {type, {}, -kInfinity, kInfinity, scaled.z_scale, scaled.z_offset};
}

/// Integers without a void to spare: a larger type has one.
MosaicSamples widened(const SampleKind& kind) {
  MosaicSamples samples;
  samples.kind = plain_kind(wider(kind.type), kind);
  const bool floating = is_floating(samples.kind.type);
  const double gap = floating ? kNaN : limits_of(samples.kind.type).lowest;
  if (!floating) {
    samples.kind.void_values = {gap};
    samples.kind.valid_min = gap + 1.0;  // which tells that no file means it
  }
  samples.gap = stored_sample(samples.kind.type, gap);
  samples.notes.push_back(
      fmt::format("{} has no number to spare for voids in all files; samples become {} (`void_values` V gives them "
                  "one)",
                  to_string(kind.type), to_string(samples.kind.type)));
  return samples;
}

template <typename T>
void lay_integers_over(const T* __restrict upper, T* __restrict lower, std::size_t count, T void_value) {
  for (std::size_t i = 0; i < count; ++i) {
    const T above = upper[i];
    lower[i] = above != void_value || lower[i] == void_value ? above : lower[i];
  }
}

template <typename T>
void lay_one_void_over(const std::byte* upper, std::byte* lower, std::size_t count, double void_value) {
  // Through arrays of the type's own alignment.
  constexpr std::size_t kAtOnce = 1024;
  T above[kAtOnce];
  T below[kAtOnce];
  for (std::size_t from = 0; from < count; from += kAtOnce) {
    const std::size_t part = std::min(kAtOnce, count - from);
    std::memcpy(above, upper + from * sizeof(T), part * sizeof(T));
    std::memcpy(below, lower + from * sizeof(T), part * sizeof(T));
    lay_integers_over(above, below, part, static_cast<T>(void_value));
    std::memcpy(lower + from * sizeof(T), below, part * sizeof(T));
  }
}

}  // namespace

SampleKind SampleKind::of(const SourceInfo& info) {
  return {info.sample_type, info.void_values, info.valid_min, info.valid_max, info.z_scale, info.z_offset};
}

MosaicSamples choose_mosaic_samples(const std::vector<SampleKind>& kinds, bool gaps, const char* why_interpolated) {
  const bool interpolated = why_interpolated != nullptr;
  ISOHF_ASSERT(!kinds.empty());
  const SampleKind& first = kinds.front();
  const auto all = [&](auto holds) { return std::all_of(kinds.begin(), kinds.end(), holds); };
  MosaicSamples samples;
  if (!all([&](const SampleKind& kind) { return kind.z_scale == first.z_scale && kind.z_offset == first.z_offset; })) {
    samples.kind = plain_kind(SampleType::kFloat64, {});
    samples.gap = stored_sample(samples.kind.type, kNaN);
    samples.notes.emplace_back("the files differ in scale or offset; samples become elevations, float64");
    return samples;
  }
  if (!interpolated && all([&](const SampleKind& kind) { return kind == first; })) {
    const std::optional<double> gap = gap_of(first);
    if (!gap && gaps) return widened(first);
    samples.kind = first;
    samples.gap = stored_sample(first.type, gap.value_or(0.0));
    return samples;
  }
  samples.kind = plain_kind(common_type(kinds, interpolated), first);
  if (is_floating(samples.kind.type)) {
    samples.gap = stored_sample(samples.kind.type, kNaN);
  } else {
    const bool has_voids =
        gaps || !all([](const SampleKind& kind) { return kind.void_values.empty() && !is_bounded(kind); });
    const std::optional<double> value = common_void(kinds, samples.kind.type);
    if (has_voids && !value) return widened(samples.kind);
    if (has_voids) samples.kind.void_values = {*value};
    samples.gap = stored_sample(samples.kind.type, has_voids ? *value : 0.0);
  }
  if (!all([&](const SampleKind& kind) { return kind.type == samples.kind.type; })) {
    samples.notes.push_back(fmt::format("{}; samples become {}",
                                        interpolated ? why_interpolated : "the files differ in sample type",
                                        to_string(samples.kind.type)));
  }
  return samples;
}

void fill_with(std::span<const std::byte> sample, std::span<std::byte> out) {
  if (out.empty()) return;
  std::memcpy(out.data(), sample.data(), sample.size());
  for (std::size_t filled = sample.size(); filled < out.size(); filled *= 2) {
    std::memcpy(out.data() + filled, out.data(), std::min(filled, out.size() - filled));
  }
}

void convert_samples(const SampleKind& from, std::span<const std::byte> raw, const MosaicSamples& to,
                     std::span<std::byte> out) {
  if (from == to.kind) {
    std::memcpy(out.data(), raw.data(), raw.size());
    return;
  }
  const std::size_t from_bytes = size_bytes(from.type);
  const std::size_t to_bytes = size_bytes(to.kind.type);
  const std::size_t count = raw.size() / from_bytes;
  ISOHF_ASSERT(out.size() == count * to_bytes);
  const bool scales = from.z_scale != to.kind.z_scale || from.z_offset != to.kind.z_offset;
  constexpr std::size_t kAtOnce = 1024;
  double numbers[kAtOnce];
  for (std::size_t at = 0; at < count; at += kAtOnce) {
    const std::size_t part = std::min(kAtOnce, count - at);
    numbers_from_samples(from, raw.subspan(at * from_bytes, part * from_bytes), {numbers, part});
    if (scales) {
      for (std::size_t i = 0; i < part; ++i) numbers[i] = numbers[i] * from.z_scale + from.z_offset;
    }
    std::byte* const target = out.data() + at * to_bytes;
    if (is_floating(to.kind.type)) {
      samples_from_numbers(to.kind.type, {numbers, part}, {target, part * to_bytes});
      continue;
    }
    with_stored_type(to.kind.type, [&](auto zero) {
      using T = decltype(zero);
      if constexpr (std::is_integral_v<T>) {
        const T gap = stored_at<T>(to.gap.data());
        for (std::size_t i = 0; i < part; ++i) {
          const T value = std::isnan(numbers[i]) ? gap : static_cast<T>(numbers[i]);
          std::memcpy(target + i * sizeof(T), &value, sizeof(T));
        }
      }
    });
  }
}

void lay_over(const SampleKind& kind, std::span<const std::byte> upper, std::span<std::byte> lower) {
  ISOHF_ASSERT(upper.size() == lower.size());
  const std::size_t count = upper.size() / size_bytes(kind.type);
  const bool integers = !is_floating(kind.type);
  if (integers && kind.void_values.empty() && !is_bounded(kind)) {
    std::memcpy(lower.data(), upper.data(), upper.size());
    return;
  }
  with_stored_type(kind.type, [&](auto zero) {
    using T = decltype(zero);
    if constexpr (std::is_integral_v<T>) {
      if (kind.void_values.size() == 1 && !is_bounded(kind)) {
        return lay_one_void_over<T>(upper.data(), lower.data(), count, kind.void_values.front());
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::byte* const above = upper.data() + i * sizeof(T);
      std::byte* const below = lower.data() + i * sizeof(T);
      if (!is_void(kind, load<T>(above)) || is_void(kind, load<T>(below))) {
        std::memcpy(below, above, sizeof(T));
      }
    }
  });
}

void numbers_from_samples(const SampleKind& kind, std::span<const std::byte> raw, std::span<double> numbers) {
  with_stored_type(kind.type, [&](auto zero) {
    using T = decltype(zero);
    ISOHF_ASSERT(raw.size() == numbers.size() * sizeof(T));
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = load<T>(raw.data() + i * sizeof(T));
  });
  for (double& number : numbers) number = is_void(kind, number) ? kNaN : number;
}

void samples_from_numbers(SampleType type, std::span<const double> numbers, std::span<std::byte> raw) {
  ISOHF_ASSERT(type == SampleType::kFloat32 || type == SampleType::kFloat64);
  const StoreSample store = store_sample(type);
  for (std::size_t i = 0; i < numbers.size(); ++i) store(numbers[i], raw.data() + i * size_bytes(type));
}

}  // namespace isohf
