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
constexpr double kLowestInt32 = std::numeric_limits<std::int32_t>::lowest();

bool is_void(const SampleKind& kind, double number) {
  if (!std::isfinite(number) || number < kind.valid_min || number > kind.valid_max) return true;
  return std::ranges::find(kind.void_values, number) != kind.void_values.end();
}

/// The only void of integers, if they have just one.
std::optional<double> only_void(const SampleKind& kind) {
  if (is_floating(kind.type) || kind.void_values.size() != 1 || std::isfinite(kind.valid_max)) return std::nullopt;
  const double value = kind.void_values.front();
  const auto [lowest, highest] = sample_range(kind.type);
  const bool is_bound = value == lowest && kind.valid_min == value + 1.0;
  const bool is_alone = kind.valid_min <= lowest || is_bound;
  return is_alone && value >= lowest && value <= highest ? std::optional(value) : std::nullopt;
}

bool has_voids(const SampleKind& kind) {
  return is_floating(kind.type) || !kind.void_values.empty() || std::isfinite(kind.valid_min) ||
         std::isfinite(kind.valid_max);
}

/// A raw number that is void in a kind; nullopt if it has none.
std::optional<double> void_of(const SampleKind& kind) {
  for (const double value : kind.void_values) {
    if (std::isfinite(value)) return value;
  }
  if (is_floating(kind.type)) return kNaN;
  const auto [lowest, highest] = sample_range(kind.type);
  if (kind.valid_min > lowest) return lowest;
  if (kind.valid_max < highest) return highest;
  return std::nullopt;
}

/// The smallest of int32, float32 and float64 that holds every raw sample of all kinds exactly, and another number.
SampleType common_type(const std::vector<SampleKind>& kinds, bool floating) {
  bool narrow = true;  // 24 bits hold all
  bool has_room = true;
  for (const SampleKind& kind : kinds) {
    floating = floating || is_floating(kind.type);
    narrow = narrow && kind.type != SampleType::kUint32 && kind.type != SampleType::kInt32 &&
             kind.type != SampleType::kFloat64;
    has_room = has_room && kind.type != SampleType::kUint32 &&
               (kind.type != SampleType::kInt32 || is_void(kind, kLowestInt32));
  }
  if (floating) return narrow ? SampleType::kFloat32 : SampleType::kFloat64;
  return has_room ? SampleType::kInt32 : SampleType::kFloat64;
}

}  // namespace

SampleKind SampleKind::of(const SourceInfo& info) {
  return {info.sample_type, info.void_values, info.valid_min, info.valid_max, info.z_scale, info.z_offset};
}

void SampleKind::put_into(SourceInfo& info) const {
  info.sample_type = type;
  info.void_values = void_values;
  info.valid_min = valid_min;
  info.valid_max = valid_max;
  info.z_scale = z_scale;
  info.z_offset = z_offset;
}

MosaicSamples choose_mosaic_samples(const std::vector<SampleKind>& kinds, bool gaps, const char* why_interpolated) {
  ISOHF_ASSERT(!kinds.empty());
  const SampleKind& first = kinds.front();
  const auto all = [&](auto holds) { return std::ranges::all_of(kinds, holds); };
  const bool is_one_kind = all([&](const SampleKind& kind) { return kind == first; });
  MosaicSamples samples;
  if (is_one_kind && why_interpolated == nullptr && (has_voids(first) || !gaps)) {
    samples.kind = first;
    samples.gap = stored_sample(first.type, void_of(first).value_or(0.0));
    return samples;
  }
  SampleKind& kind = samples.kind;
  kind = {SampleType::kFloat64, {}, -kInfinity, kInfinity, first.z_scale, first.z_offset};
  const bool is_one_type = all([&](const SampleKind& other) { return other.type == first.type; });
  const bool is_one_scale =
      all([&](const SampleKind& other) { return other.z_scale == first.z_scale && other.z_offset == first.z_offset; });
  // Integers of one type may have a void in common.
  const auto shared = std::ranges::find_if(first.void_values, [&](double value) {
    return void_value_as_stored(first.type, value) && all([&](const auto& other) { return is_void(other, value); });
  });
  if (is_one_type && is_one_scale && why_interpolated == nullptr && !is_floating(first.type) &&
      shared != first.void_values.end()) {
    kind.type = first.type;
    kind.void_values = {*shared};
    samples.gap = stored_sample(kind.type, *shared);
    return samples;
  }
  if (!is_one_scale) {
    kind.z_scale = 1.0;
    kind.z_offset = 0.0;
    samples.notes.emplace_back("the files differ in scale or offset; samples become elevations, float64");
  } else {
    kind.type = common_type(kinds, why_interpolated != nullptr);
    const char* const why = why_interpolated != nullptr ? why_interpolated
                            : is_one_type               ? "the files differ in nodata"
                                                        : "the files differ in sample type";
    if (is_one_kind && why_interpolated == nullptr) {
      samples.notes.push_back(
          fmt::format("{} has no number to spare for voids; samples become {} (`void_values` V gives them one)",
                      to_string(first.type), to_string(kind.type)));
    } else if (!is_one_type || kind.type != first.type) {
      samples.notes.push_back(fmt::format("{}; samples become {}", why, to_string(kind.type)));
    }
  }
  if (!is_floating(kind.type)) {
    kind.void_values = {kLowestInt32};
    kind.valid_min = kLowestInt32 + 1.0;  // no file means it
  }
  samples.gap = stored_sample(kind.type, is_floating(kind.type) ? kNaN : kLowestInt32);
  return samples;
}

void fill_with(std::span<const std::byte> sample, std::span<std::byte> out) {
  if (out.empty()) return;
  std::memcpy(out.data(), sample.data(), sample.size());
  for (std::size_t filled = sample.size(); filled < out.size(); filled *= 2)
    std::memcpy(out.data() + filled, out.data(), std::min(filled, out.size() - filled));
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
  const double gap = load_sample(to.kind.type)(to.gap.data());
  const bool scales = from.z_scale != to.kind.z_scale || from.z_offset != to.kind.z_offset;
  constexpr std::size_t kAtOnce = 1024;
  double numbers[kAtOnce];
  for (std::size_t at = 0; at < count; at += kAtOnce) {
    const std::span part(numbers, std::min(kAtOnce, count - at));
    numbers_from_samples(from, raw.subspan(at * from_bytes, part.size() * from_bytes), part);
    for (double& number : part) {
      if (scales) number = number * from.z_scale + from.z_offset;
      if (std::isnan(number)) number = gap;
    }
    samples_from_numbers(to.kind.type, part, out.subspan(at * to_bytes, part.size() * to_bytes));
  }
}

void lay_over(const SampleKind& kind, std::span<const std::byte> upper, std::span<std::byte> lower) {
  ISOHF_ASSERT(upper.size() == lower.size());
  if (!has_voids(kind)) {
    std::memcpy(lower.data(), upper.data(), upper.size());
    return;
  }
  with_stored_type(kind.type, [&](auto zero) {
    using T = decltype(zero);
    const std::size_t count = upper.size() / sizeof(T);
    const std::byte* const from = upper.data();
    std::byte* const to = lower.data();
    const auto lay = [&](auto is_void_sample) {
      for (std::size_t i = 0; i < count; ++i) {
        const T above = stored_at<T>(from + i * sizeof(T));
        const T below = stored_at<T>(to + i * sizeof(T));
        const T shown = !is_void_sample(above) || is_void_sample(below) ? above : below;
        std::memcpy(to + i * sizeof(T), &shown, sizeof(T));
      }
    };
    if constexpr (std::is_integral_v<T>) {
      if (const std::optional<double> value = only_void(kind))
        return lay([only = static_cast<T>(*value)](T sample) { return sample == only; });
    }
    lay([&](T sample) { return is_void(kind, static_cast<double>(number_of(sample))); });
  });
}

void numbers_from_samples(const SampleKind& kind, std::span<const std::byte> raw, std::span<double> numbers) {
  with_stored_type(kind.type, [&](auto zero) {
    using T = decltype(zero);
    ISOHF_ASSERT(raw.size() == numbers.size() * sizeof(T));
    for (std::size_t i = 0; i < numbers.size(); ++i)
      numbers[i] = static_cast<double>(number_of(stored_at<T>(raw.data() + i * sizeof(T))));
  });
  for (double& number : numbers) number = is_void(kind, number) ? kNaN : number;
}

void samples_from_numbers(SampleType type, std::span<const double> numbers, std::span<std::byte> raw) {
  const StoreSample store = store_sample(type);
  for (std::size_t i = 0; i < numbers.size(); ++i) store(numbers[i], raw.data() + i * size_bytes(type));
}

}  // namespace isohf
