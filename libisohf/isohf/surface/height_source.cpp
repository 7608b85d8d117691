#include "isohf/surface/height_source.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

template <typename T>
T load(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

/// Converts, then overwrites voids: the first loop stays free of branches and vectorises.
template <typename T, typename Widen>
void convert(const SourceInfo& info, double datum, const std::byte* raw, std::span<float> heights, Widen widen) {
  const double scale = info.z_scale;
  const double offset = info.z_offset - datum;
  const std::size_t count = heights.size();
  if (scale == 1.0 && offset == 0.0) {
    for (std::size_t i = 0; i < count; ++i) heights[i] = static_cast<float>(widen(load<T>(raw + i * sizeof(T))));
  } else {
    for (std::size_t i = 0; i < count; ++i) {
      heights[i] = static_cast<float>(static_cast<double>(widen(load<T>(raw + i * sizeof(T)))) * scale + offset);
    }
  }
  const auto void_where = [&](auto is_void) {
    for (std::size_t i = 0; i < count; ++i) {
      if (is_void(static_cast<double>(widen(load<T>(raw + i * sizeof(T)))))) heights[i] = kVoid;
    }
  };
  for (const double value : info.void_values) {
    if (!std::isnan(value)) void_where([value](double sample) { return sample == value; });
  }
  if (std::isfinite(info.valid_min) || std::isfinite(info.valid_max)) {
    void_where([&](double sample) { return sample < info.valid_min || sample > info.valid_max; });
  }
  if constexpr (std::is_floating_point_v<decltype(widen(T{}))>) {
    for (float& height : heights) height = std::isfinite(height) ? height : kVoid;
  }
}

}  // namespace

void heights_from_samples(const SourceInfo& info, double datum, std::span<const std::byte> raw,
                          std::span<float> heights) {
  ISOHF_ASSERT(raw.size() == heights.size() * size_bytes(info.sample_type));
  const auto same = [](auto value) { return value; };
  switch (info.sample_type) {
    case SampleType::kUint8:
      return convert<std::uint8_t>(info, datum, raw.data(), heights, same);
    case SampleType::kInt8:
      return convert<std::int8_t>(info, datum, raw.data(), heights, same);
    case SampleType::kUint16:
      return convert<std::uint16_t>(info, datum, raw.data(), heights, same);
    case SampleType::kInt16:
      return convert<std::int16_t>(info, datum, raw.data(), heights, same);
    case SampleType::kUint32:
      return convert<std::uint32_t>(info, datum, raw.data(), heights, same);
    case SampleType::kInt32:
      return convert<std::int32_t>(info, datum, raw.data(), heights, same);
    case SampleType::kFloat16:
      return convert<std::uint16_t>(info, datum, raw.data(), heights, float_from_half);
    case SampleType::kFloat32:
      return convert<float>(info, datum, raw.data(), heights, same);
    case SampleType::kFloat64:
      return convert<double>(info, datum, raw.data(), heights, same);
  }
}

}  // namespace isohf
