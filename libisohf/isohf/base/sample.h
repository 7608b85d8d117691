#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

#include "isohf/raster.h"

/// Raw samples: their types, and numbers <-> what is stored. Nothing else converts samples, except for the residual
/// coder's half-precision predictions, whose rounding is part of the archive format.

namespace isohf {

/// Half-precision bits to float, exact.
[[nodiscard]] float float_from_half(std::uint16_t bits);
/// The nearest half-precision number, ties to even; infinite from 65520 on.
[[nodiscard]] std::uint16_t half_from_double(double value);

/// A half-precision sample as it is stored; a type of its own, so that it is no integer.
struct StoredHalf {
  std::uint16_t bits;
};

/// Returns with(T{}) for the type T that a sample is stored as.
template <typename With>
auto with_stored_type(SampleType type, With with) {
  switch (type) {
    case SampleType::kUint8:
      return with(std::uint8_t{});
    case SampleType::kInt8:
      return with(std::int8_t{});
    case SampleType::kUint16:
      return with(std::uint16_t{});
    case SampleType::kInt16:
      return with(std::int16_t{});
    case SampleType::kUint32:
      return with(std::uint32_t{});
    case SampleType::kInt32:
      return with(std::int32_t{});
    case SampleType::kFloat16:
      return with(StoredHalf{});
    case SampleType::kFloat32:
      return with(float{});
    case SampleType::kFloat64:
      break;
  }
  return with(double{});
}

/// The sample that begins at a byte, aligned or not.
template <typename T>
[[nodiscard]] T stored_at(const std::byte* at) {
  T value;
  std::memcpy(&value, at, sizeof(T));
  return value;
}

/// A stored sample as a number: halves as float, all others as they are.
template <typename T>
[[nodiscard]] auto number_of(T stored) {
  if constexpr (std::is_same_v<T, StoredHalf>) {
    return float_from_half(stored.bits);
  } else {
    return stored;
  }
}

using LoadSample = double (*)(const std::byte* at);
using StoreSample = void (*)(double raw, std::byte* at);

/// Reads one raw sample of the type, exactly.
[[nodiscard]] LoadSample load_sample(SampleType type);
/// Writes one. `raw` must be a number that the type holds (nearest_sample); of floats also NaN.
[[nodiscard]] StoreSample store_sample(SampleType type);

/// The lowest and the highest finite number that the type holds.
[[nodiscard]] std::pair<double, double> sample_range(SampleType type);

/// The number nearest to `raw` that the type holds; its largest or smallest beyond these. Ties go up for integers, to
/// even for floats. `raw` is no NaN.
[[nodiscard]] double nearest_sample(SampleType type, double raw);
/// The same; nullopt where the nearest number would not be one of the type: an integer beyond its range, or an infinity.
[[nodiscard]] std::optional<double> rounded_sample(SampleType type, double raw);
/// The next larger and the next smaller number that the type holds; the same where there is none. `raw` is held.
[[nodiscard]] double next_sample(SampleType type, double raw);
[[nodiscard]] double previous_sample(SampleType type, double raw);

/// Raw samples -> elevations, relative to `datum`: float(raw * z_scale + z_offset - datum), NaN where void.
/// raw [count samples of info.sample_type]   heights [count] out, vertical units of the source
/// The arithmetic is double until the last rounding; with datum 0, scale 1 and offset 0 samples of up to 24 bits and
/// floats come through unchanged. Vectorised, cannot fail.
void heights_from_samples(const SourceInfo& info, double datum, std::span<const std::byte> raw,
                          std::span<float> heights);

}  // namespace isohf
