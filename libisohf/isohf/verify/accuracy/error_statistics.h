#pragma once

#include <cstdint>
#include <vector>

#include "isohf/lattice.h"

namespace isohf {

/// Absolute errors by magnitude: 64 bins an octave, so that a percentile is known to 1.1 % in constant memory (255
/// KiB). Counts alone: adding in any order gives the same.
class ErrorHistogram {
 public:
  ErrorHistogram();

  void add(double error);  ///< >= 0
  void add(const ErrorHistogram& other);
  /// Upper end of the bin that holds the given share of all errors; 0 where there are none.
  [[nodiscard]] double percentile(double share) const;

 private:
  std::vector<std::int64_t> counts_;
};

/// What a run of errors adds up to. To be the same for any number of threads, runs are added in a fixed order.
struct ErrorSums {
  std::int64_t count = 0;
  double squares = 0.0;
  double max = 0.0;
  WorldPoint worst{};  ///< where the first largest error lies

  void add(double error, WorldPoint place) {
    ++count;
    squares += error * error;
    if (error > max) {
      max = error;
      worst = place;
    }
  }
  void add(const ErrorSums& later);
  [[nodiscard]] double rms() const;  ///< 0 where there are none
};

/// 20 log10(range / rms); infinite where rms is 0.
[[nodiscard]] double psnr_db(double range, double rms);

}  // namespace isohf
