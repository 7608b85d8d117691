#include "isohf/base/sample.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <limits>
#include <vector>

#include "isohf/base/assert.h"
#include "isohf/base/void_values.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::array<std::pair<SampleType, const char*>, 9> kSampleTypeNames = {{
    {SampleType::kUint8, "uint8"},
    {SampleType::kInt8, "int8"},
    {SampleType::kUint16, "uint16"},
    {SampleType::kInt16, "int16"},
    {SampleType::kUint32, "uint32"},
    {SampleType::kInt32, "int32"},
    {SampleType::kFloat16, "float16"},
    {SampleType::kFloat32, "float32"},
    {SampleType::kFloat64, "float64"},
}};

constexpr double kMaxHalf = 65504.0;  // (2 - 2^-10) * 2^15

template <typename T>
double load(const std::byte* at) {
  return static_cast<double>(number_of(stored_at<T>(at)));
}

template <typename T>
void store(double raw, std::byte* at) {
  T value;
  if constexpr (std::is_same_v<T, StoredHalf>) {
    value.bits = half_from_double(raw);
  } else {
    value = static_cast<T>(raw);
  }
  std::memcpy(at, &value, sizeof value);
}

template <typename T>
constexpr double lowest() {
  if constexpr (std::is_same_v<T, StoredHalf>)
    return -kMaxHalf;
  else
    return static_cast<double>(std::numeric_limits<T>::lowest());
}
template <typename T>
constexpr double highest() {
  if constexpr (std::is_same_v<T, StoredHalf>)
    return kMaxHalf;
  else
    return static_cast<double>(std::numeric_limits<T>::max());
}

template <typename T>
double nearest(double raw) {
  if constexpr (std::is_integral_v<T>) {
    return std::clamp(std::floor(raw + 0.5), lowest<T>(), highest<T>());
  } else {
    const double inside = std::clamp(raw, lowest<T>(), highest<T>());
    if constexpr (std::is_same_v<T, StoredHalf>)
      return static_cast<double>(float_from_half(half_from_double(inside)));
    else
      return static_cast<double>(static_cast<T>(inside));
  }
}

template <typename T>
bool reaches(double raw) {
  if constexpr (std::is_integral_v<T>)
    return raw >= lowest<T>() - 0.5 && raw < highest<T>() + 0.5;
  else if constexpr (std::is_same_v<T, StoredHalf>)
    return std::abs(raw) < 65520.0;
  else
    return std::isfinite(static_cast<T>(raw));
}

template <typename T>
double next(double raw) {
  if (raw >= highest<T>()) return raw;
  if constexpr (std::is_integral_v<T>) {
    return raw + 1.0;
  } else if constexpr (std::is_same_v<T, StoredHalf>) {
    if (raw == 0.0) return 0x1p-24;
    const auto bits = static_cast<unsigned>(half_from_double(raw));
    return static_cast<double>(float_from_half(static_cast<std::uint16_t>(raw > 0.0 ? bits + 1 : bits - 1)));
  } else {
    return static_cast<double>(std::nextafter(static_cast<T>(raw), std::numeric_limits<T>::max()));
  }
}

template <typename T>
double previous(double raw) {
  if constexpr (std::is_integral_v<T>) {
    return std::max(raw - 1.0, lowest<T>());
  } else {
    return -next<T>(-raw);
  }
}

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

/// Whether some sample of type W can be equal to `value`; where none can, conversions to W have no meaning.
template <typename W>
bool is_a(double value) {
  constexpr auto kMost = static_cast<double>(std::numeric_limits<W>::max());
  if constexpr (std::is_integral_v<W>) {
    return value >= static_cast<double>(std::numeric_limits<W>::min()) && value <= kMost && std::floor(value) == value;
  } else {
    return std::abs(value) <= kMost && static_cast<double>(static_cast<W>(value)) == value;
  }
}

/// Raw samples in a range, in their own type: integers compare several times as fast as the doubles they are given in.
template <typename W>
struct RawRange {
  W least{};
  W most{};
  bool is_empty = false;

  RawRange(double low, double high) {
    constexpr auto kLeast = static_cast<double>(std::numeric_limits<W>::lowest());
    constexpr auto kMost = static_cast<double>(std::numeric_limits<W>::max());
    is_empty = !(low <= kMost && high >= kLeast);
    if (is_empty) return;
    least = static_cast<W>(std::max(low, kLeast));
    most = static_cast<W>(std::min(high, kMost));
    if (static_cast<double>(least) < low) least = next(least, std::numeric_limits<W>::max());
    if (static_cast<double>(most) > high) most = next(most, std::numeric_limits<W>::lowest());
  }

 private:
  static W next(W value, W towards) {
    if constexpr (std::is_integral_v<W>) {
      return value == towards ? value : static_cast<W>(towards > value ? value + 1 : value - 1);
    } else {
      return std::nextafter(value, towards);
    }
  }
};

/// Raw samples to heights, and to voids where some are equal to a void value or lie outside the valid range. Loops
/// choose and do not branch, so that they vectorise.
template <typename T>
void convert(const SourceInfo& info, double datum, const std::byte* raw, std::span<float> heights) {
  using Wide = decltype(number_of(T{}));
  const double scale = info.z_scale;
  const double offset = info.z_offset - datum;
  const bool is_whole = offset == std::floor(offset) && std::abs(offset) < 0x1p23;
  const std::int32_t whole = is_whole ? static_cast<std::int32_t>(offset) : 0;
  const std::size_t count = heights.size();
  const auto sample = [&](std::size_t i) { return number_of(stored_at<T>(raw + i * sizeof(T))); };
  const auto convert_all = [&](auto is_void) {
    if (scale == 1.0 && offset == 0.0) {
      for (std::size_t i = 0; i < count; ++i) {
        const Wide value = sample(i);
        heights[i] = is_void(value) ? kVoid : static_cast<float>(value);
      }
    } else if (sizeof(T) <= 2 && std::is_integral_v<T> && scale == 1.0 && is_whole) {
      for (std::size_t i = 0; i < count; ++i) {  // no rounding, and no doubles
        const Wide value = sample(i);
        const auto height = static_cast<float>(static_cast<std::int32_t>(value) + whole);
        heights[i] = is_void(value) ? kVoid : height;
      }
    } else {
      for (std::size_t i = 0; i < count; ++i) {
        const Wide value = sample(i);
        const auto height = static_cast<float>(static_cast<double>(value) * scale + offset);
        heights[i] = is_void(value) ? kVoid : height;
      }
    }
  };
  const auto void_where = [&](auto is_void) {
    for (std::size_t i = 0; i < count; ++i) heights[i] = is_void(sample(i)) ? kVoid : heights[i];
  };
  std::vector<Wide> voids;
  for (const double value : info.void_values) {
    if (is_a<Wide>(value)) voids.push_back(static_cast<Wide>(value));
  }
  if (voids.empty()) {
    convert_all([](Wide) { return false; });
  } else {
    convert_all([value = voids.front()](Wide raw_sample) { return raw_sample == value; });
  }
  for (std::size_t i = 1; i < voids.size(); ++i) {
    void_where([value = voids[i]](Wide raw_sample) { return raw_sample == value; });
  }
  if (std::isfinite(info.valid_min) || std::isfinite(info.valid_max)) {
    const RawRange<Wide> range(info.valid_min, info.valid_max);
    if (range.is_empty) {
      std::fill(heights.begin(), heights.end(), kVoid);
    } else {
      void_where([range](Wide value) { return (value < range.least) | (value > range.most); });
    }
  }
  if constexpr (std::is_floating_point_v<Wide>) {
    for (float& height : heights) height = std::isfinite(height) ? height : kVoid;
  }
}

}  // namespace

std::size_t size_bytes(SampleType type) {
  switch (type) {
    case SampleType::kUint8:
    case SampleType::kInt8:
      return 1;
    case SampleType::kUint16:
    case SampleType::kInt16:
    case SampleType::kFloat16:
      return 2;
    case SampleType::kUint32:
    case SampleType::kInt32:
    case SampleType::kFloat32:
      return 4;
    case SampleType::kFloat64:
      return 8;
  }
  return 0;
}

std::string to_string(SampleType type) {
  for (const auto& [known, name] : kSampleTypeNames) {
    if (known == type) return name;
  }
  return {};
}

SampleType sample_type_from_string(const std::string& text) {
  for (const auto& [type, name] : kSampleTypeNames) {
    if (text == name) return type;
  }
  throw Error(ErrorCode::kInvalidArgument,
              "sample type is \"" + text +
                  "\", must be uint8, int8, uint16, int16, uint32, int32, float16, float32 or float64");
}

bool is_floating(SampleType type) {
  return type == SampleType::kFloat16 || type == SampleType::kFloat32 || type == SampleType::kFloat64;
}

std::string to_string(Registration registration) {
  switch (registration) {
    case Registration::kArea:
      return "area";
    case Registration::kPoint:
      return "point";
    case Registration::kUnknown:
      break;
  }
  return "unknown";
}

float float_from_half(std::uint16_t bits) {
  const std::uint32_t sign = std::uint32_t{bits & 0x8000U} << 16U;
  const std::uint32_t exponent = (bits >> 10U) & 0x1FU;
  const std::uint32_t mantissa = bits & 0x3FFU;
  if (exponent == 0x1FU) return std::bit_cast<float>(sign | 0x7F800000U | (mantissa << 13U));
  if (exponent != 0U) return std::bit_cast<float>(sign | ((exponent + 112U) << 23U) | (mantissa << 13U));
  // Zero and subnormals: mantissa * 2^-24, exact in single precision.
  const float magnitude = static_cast<float>(mantissa) * 0x1p-24F;
  return sign != 0U ? -magnitude : magnitude;
}

std::uint16_t half_from_double(double value) {
  const unsigned sign = std::signbit(value) ? 0x8000U : 0U;
  const double size = std::abs(value);
  if (std::isnan(value)) return 0x7E00;
  if (size >= 65520.0) return static_cast<std::uint16_t>(sign | 0x7C00U);
  // Multiples of 2^-24, and of 2^(e-10) from 2^e on: 2^10 to 2^11 of them for normal numbers, less for subnormal ones.
  // Where rounding reaches 2^11, the sum carries into the exponent.
  const int exponent = std::max(size > 0.0 ? std::ilogb(size) : -14, -14);
  const auto steps = static_cast<unsigned>(std::nearbyint(std::ldexp(size, 10 - exponent)));
  return static_cast<std::uint16_t>(sign | (steps + (static_cast<unsigned>(exponent + 14) << 10U)));
}

LoadSample load_sample(SampleType type) {
  return with_stored_type(type, [](auto sample) -> LoadSample { return load<decltype(sample)>; });
}

StoreSample store_sample(SampleType type) {
  return with_stored_type(type, [](auto sample) -> StoreSample { return store<decltype(sample)>; });
}

double nearest_sample(SampleType type, double raw) {
  return with_stored_type(type, [raw](auto sample) { return nearest<decltype(sample)>(raw); });
}

std::optional<double> rounded_sample(SampleType type, double raw) {
  return with_stored_type(type, [raw](auto sample) -> std::optional<double> {
    using T = decltype(sample);
    if (!reaches<T>(raw)) return std::nullopt;
    return nearest<T>(raw);
  });
}

std::pair<double, double> sample_range(SampleType type) {
  return with_stored_type(
      type, [](auto sample) { return std::pair(lowest<decltype(sample)>(), highest<decltype(sample)>()); });
}

double next_sample(SampleType type, double raw) {
  return with_stored_type(type, [raw](auto sample) { return next<decltype(sample)>(raw); });
}

double previous_sample(SampleType type, double raw) {
  return with_stored_type(type, [raw](auto sample) { return previous<decltype(sample)>(raw); });
}

void heights_from_samples(const SourceInfo& info, double datum, std::span<const std::byte> raw,
                          std::span<float> heights) {
  ISOHF_ASSERT(raw.size() == heights.size() * size_bytes(info.sample_type));
  with_stored_type(info.sample_type, [&](auto sample) { convert<decltype(sample)>(info, datum, raw.data(), heights); });
}

std::string shortest_text(SampleType type, double value) {
  const bool is_single = type == SampleType::kFloat32 || type == SampleType::kFloat16;
  const std::string text = fmt::format("{:.6g}", value);
  const double read = std::strtod(text.c_str(), nullptr);
  if (is_single ? static_cast<float>(read) == static_cast<float>(value) : read == value) return text;
  return is_single ? fmt::format("{}", static_cast<float>(value)) : fmt::format("{}", value);
}

std::string void_values_with(const SourceInfo& info, std::vector<double> values) {
  // What is declared goes on to mean it, but what a range makes void anyway.
  const auto is_void_anyway = [&](double value) { return !(value >= info.valid_min && value <= info.valid_max); };
  const auto& declared = info.void_values_of_files.empty() ? info.void_values : info.void_values_of_files;
  std::ranges::remove_copy_if(declared, std::inserter(values, values.begin()), is_void_anyway);
  std::string text = "`void_values`";
  for (std::size_t i = 0; i < values.size(); ++i) {
    text.append(i == 0 ? " " : ",").append(shortest_text(info.sample_type, values[i]));
  }
  return text;
}

}  // namespace isohf
