#include "isohf/raster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>
#include <vector>

#include "isohf/base/assert.h"
#include "isohf/surface/source/sample_types.h"

namespace isohf {
namespace {

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
  const std::size_t count = heights.size();
  const auto sample = [&](std::size_t i) { return number_of(stored_at<T>(raw + i * sizeof(T))); };
  const auto convert_all = [&](auto is_void) {
    if (scale == 1.0 && offset == 0.0) {
      for (std::size_t i = 0; i < count; ++i) {
        const Wide value = sample(i);
        heights[i] = is_void(value) ? kVoid : static_cast<float>(value);
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

void heights_from_samples(const SourceInfo& info, double datum, std::span<const std::byte> raw,
                          std::span<float> heights) {
  ISOHF_ASSERT(raw.size() == heights.size() * size_bytes(info.sample_type));
  with_stored_type(info.sample_type, [&](auto sample) { convert<decltype(sample)>(info, datum, raw.data(), heights); });
}

}  // namespace isohf
