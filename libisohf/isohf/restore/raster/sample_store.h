#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/surface.h"

namespace isohf {

/// The raw value that stands for nodata in samples of a type; nullopt for floats, which have NaN.
[[nodiscard]] std::optional<double> usual_nodata(SampleType type);

/// The mapping that spreads elevations over all numbers of an integer type, one of them kept for nodata where there is
/// any.
[[nodiscard]] SampleMapping spread(SampleType type, std::pair<double, double> elevations, bool has_nodata);

/// Elevations into raw samples of a raster's type.
class SampleStore {
 public:
  enum class Outcome : std::uint8_t { kStored, kNodata, kClamped, kRefused };

  /// Which samples that the type does not hold are moved to the end of its range.
  enum class Clamp { kNone, kAtFreeEnds, kAll };  ///< a free end is none that is kept for nodata

  /// nodata  raw value kept for nodata, at an end of an integer type's range; nullopt: floats take NaN, and an integer
  ///         type uses its whole range and holds no nodata
  SampleStore(const SampleMapping& mapping, std::optional<double> nodata, Clamp clamp);

  /// Writes size_bytes(type) bytes at `raw`, none where it refuses. NaN is nodata.
  Outcome store(double elevation, std::byte* raw) const;
  [[nodiscard]] const SampleMapping& mapping() const { return mapping_; }
  /// Whether a raw number is one of the type, exactly.
  [[nodiscard]] bool holds(double raw) const;

  struct Result {
    std::int64_t nodata = 0;
    std::int64_t clamped = 0;
    std::optional<std::size_t> refused;  ///< the first that the type does not hold
  };
  /// raw [n samples] out, of elevations [n]. Works on the caller's oneTBB arena.
  Result store(std::span<const double> elevations, std::span<std::byte> raw) const;

 private:
  SampleMapping mapping_;
  std::optional<double> nodata_;
  Clamp clamp_;
  double low_;  ///< smallest and largest raw number that is an elevation
  double high_;
};

/// The raster whose samples are stored, for messages.
struct StoredRaster {
  std::string path;
  std::int64_t width = 0;
  std::string remedy;  ///< for a sample that its type does not hold
};

/// Throws Error{kInvalidArgument} for a sample that the raster's type does not hold, by its number from 0 on.
[[noreturn]] void refuse_sample(const StoredRaster& raster, SampleType type, std::int64_t sample,
                                const std::string& value);

/// Rows of elevations, NaN for nodata, into raw rows of a raster.
class RowStore {
 public:
  RowStore(const SampleStore& store, StoredRaster raster) : store_(store), raster_(std::move(raster)) {}

  /// Throws Error{kInvalidArgument} as refuse_sample.
  [[nodiscard]] std::vector<std::byte> raw_rows(std::int64_t first_row, std::span<const double> elevations);
  /// Of all rows so far.
  [[nodiscard]] const SampleStore::Result& counts() const { return counts_; }

 private:
  SampleStore store_;
  StoredRaster raster_;
  SampleStore::Result counts_;
};

/// Raw samples of a record in another type, number for number; those that are void as `nodata`, where that is given.
/// raw [n samples of the record's type]   out [n samples of `to`]. Returns the first that `to` does not hold.
[[nodiscard]] std::optional<std::size_t> convert_exactly(const LosslessRecord& record, std::span<const std::byte> raw,
                                                         std::optional<double> nodata, SampleType to,
                                                         std::span<std::byte> out);

/// Raw samples as the elevations that they mean, NaN where void: decimals where the scale is one over a whole number.
/// raw [n samples of the record's type]   out [n doubles]
void elevations_of(const LosslessRecord& record, std::span<const std::byte> raw, std::span<std::byte> out);

}  // namespace isohf
