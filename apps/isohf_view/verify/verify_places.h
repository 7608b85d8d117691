#pragma once

#include <string>
#include <utility>

#include "verify/mesh_oracle.h"
#include "verify/verify_report.h"

namespace isohf::view {

// Why tolerances are what they are: codes and unit normals pass through 32-bit interpolation, whose planes are told
// from the picture's corner: an error of about spread·2^-21 for each pixel of distance, where spread is the difference
// that a triangle spans. The fixed part is the float rounding of 65535.
inline constexpr double kCodeTolerance = 0.05;
inline constexpr double kPerPixel = 1.0 / (1 << 21);

/// Keeps the worst of many deviations and how many there were.
class Worst {
 public:
  template <typename Describe>
  void add(double deviation, Describe&& describe) {
    ++count_;
    if (!(deviation > worst_) && count_ > 1) return;
    worst_ = deviation;
    where_ = describe();
  }
  [[nodiscard]] bool any() const { return count_ > 0; }
  [[nodiscard]] Finding finding(Check check, TileIndex tile, double level) const {
    return {check, tile, level, where_, worst_, count_};
  }

 private:
  double worst_ = -1.0;
  std::int64_t count_ = 0;
  std::string where_;
};

/// "vertex (c 3, r 4)"
[[nodiscard]] std::string vertex_name(GridVertex vertex);

/// "object space (12.25, 3.50), triangle (c .., r ..) .." of pixel (i, j) of a window.
[[nodiscard]] std::string pixel_name(const TileShape& shape, const PixelWindow& window, int i, int j,
                                     const PixelSample& sample);

}  // namespace isohf::view
