#include "isohf/surface/source/sample_access.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "isohf/base/assert.h"
#include "isohf/surface/source/sample_types.h"

namespace isohf {
namespace {

constexpr double kMaxHalf = 65504.0;

template <typename T>
double load(const std::byte* at) {
  return static_cast<double>(number_of(stored_at<T>(at)));
}

/// Half-precision numbers are multiples of 2^-24, and of 2^(e-10) from 2^e on.
double half_step(double raw) {
  return std::ldexp(1.0, std::max(raw != 0.0 ? std::ilogb(raw) : -14, -14) - 10);
}

std::uint16_t half_bits(double raw) {
  const double magnitude = std::abs(raw);
  const int exponent = std::max(magnitude > 0.0 ? std::ilogb(magnitude) : -14, -14);
  // 2^10 to 2^11 - 1 for normal numbers, less for subnormal ones; a whole number, as `raw` is held.
  const auto steps = static_cast<unsigned>(std::ldexp(magnitude, 10 - exponent));
  const unsigned bits = steps + (static_cast<unsigned>(exponent + 14) << 10U);
  return static_cast<std::uint16_t>(bits | (std::signbit(raw) ? 0x8000U : 0U));
}

template <typename T>
void store(double raw, std::byte* at) {
  T value;
  if constexpr (std::is_same_v<T, StoredHalf>) {
    value.bits = half_bits(raw);
  } else {
    value = static_cast<T>(raw);
  }
  std::memcpy(at, &value, sizeof value);
}

template <typename T>
double nearest(double raw) {
  if constexpr (std::is_same_v<T, StoredHalf>) {
    const double step = half_step(raw);
    return std::clamp(std::nearbyint(raw / step) * step, -kMaxHalf, kMaxHalf);
  } else if constexpr (std::is_floating_point_v<T>) {
    const auto limit = static_cast<double>(std::numeric_limits<T>::max());
    return static_cast<double>(static_cast<T>(std::clamp(raw, -limit, limit)));
  } else {
    return std::clamp(std::floor(raw + 0.5), static_cast<double>(std::numeric_limits<T>::min()),
                      static_cast<double>(std::numeric_limits<T>::max()));
  }
}

template <typename T>
double next(double raw) {
  if constexpr (std::is_same_v<T, StoredHalf>) {
    // Towards zero the step just below a power of two is the smaller one.
    const double beyond = raw < 0.0 ? half_step(std::nextafter(raw, 0.0)) : half_step(raw);
    return std::min(raw + beyond, kMaxHalf);
  } else if constexpr (std::is_floating_point_v<T>) {
    return static_cast<double>(std::nextafter(static_cast<T>(raw), std::numeric_limits<T>::max()));
  } else {
    return std::min(raw + 1.0, static_cast<double>(std::numeric_limits<T>::max()));
  }
}

template <typename T>
double previous(double raw) {
  if constexpr (std::is_integral_v<T>) {
    return std::max(raw - 1.0, static_cast<double>(std::numeric_limits<T>::min()));
  } else {
    return -next<T>(-raw);
  }
}

}  // namespace

LoadSample load_sample(SampleType type) {
  return with_stored_type(type, [](auto sample) -> LoadSample { return load<decltype(sample)>; });
}

StoreSample store_sample(SampleType type) {
  return with_stored_type(type, [](auto sample) -> StoreSample { return store<decltype(sample)>; });
}

double nearest_sample(SampleType type, double raw) {
  return with_stored_type(type, [raw](auto sample) { return nearest<decltype(sample)>(raw); });
}

double next_sample(SampleType type, double raw) {
  return with_stored_type(type, [raw](auto sample) { return next<decltype(sample)>(raw); });
}

double previous_sample(SampleType type, double raw) {
  return with_stored_type(type, [raw](auto sample) { return previous<decltype(sample)>(raw); });
}

}  // namespace isohf
