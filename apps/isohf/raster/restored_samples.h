#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/restore/residual_codec.h"

namespace isohf::cli {

/// The raw value that stands for "no elevation" in samples of a type; nullopt for floats, which have NaN.
[[nodiscard]] std::optional<double> usual_void(SampleType type);

/// The lowest and highest raw number of a type.
[[nodiscard]] std::pair<double, double> sample_range(SampleType type);

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

/// Throws Error{kInvalidArgument} for a sample that a raster's type does not hold, naming its place and the remedy.
[[noreturn]] void refuse_sample(const std::string& output, SampleType type, std::int64_t column, std::int64_t row,
                                double value, const char* remedy);

struct SampleCounts {
  std::int64_t voids = 0;
  std::int64_t clamped = 0;
};

/// Rows of elevations, NaN where void, into raw samples; the first row's number and the width are for messages. Adds to
/// `counts`. Works on the caller's oneTBB arena. Throws Error{kInvalidArgument} as refuse_sample.
[[nodiscard]] std::vector<std::byte> store_rows(const SampleStore& store, SampleType type, const std::string& output,
                                                std::int64_t width, std::int64_t first_row,
                                                std::span<const double> elevations, SampleCounts& counts);

}  // namespace isohf::cli
