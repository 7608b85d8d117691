#pragma once

#include <cstddef>
#include <optional>

#include "isohf/restore/residual_codec.h"

namespace isohf::cli {

/// The raw value that stands for "no elevation" in samples of a type; nullopt for floats, which have NaN.
[[nodiscard]] std::optional<double> usual_void(SampleType type);

/// Elevations into raw samples of a raster's type.
class SampleStore {
 public:
  enum class Outcome { kStored, kVoid, kClamped, kRefused };

  /// void_value  raw value kept for voids, at an end of an integer type's range; nullopt: floats take NaN, and an
  ///             integer type uses its whole range and holds no void
  /// clamp       move what the type does not hold to the end of its range
  SampleStore(const SampleMapping& mapping, std::optional<double> void_value, bool clamp);

  /// Writes size_bytes(type) bytes at `raw`, none where it refuses. NaN is a void.
  Outcome store(double elevation, std::byte* raw) const;
  /// Whether a raw number is one of the type, exactly.
  [[nodiscard]] bool holds(double raw) const;

 private:
  SampleMapping mapping_;
  std::optional<double> void_value_;
  bool clamp_;
  double low_;  ///< smallest and largest raw number that is an elevation
  double high_;
};

}  // namespace isohf::cli
