#pragma once

#include <cstdint>

#include "isohf/archive/codec/simd/lane_residuals.h"

namespace isohf {

/// The range of each lane's samples, and the least and the most that a row had.
struct LaneRange {
  PerLane<std::int32_t> low{};
  PerLane<std::int32_t> high{};
  PerLane<std::int32_t> least_seen{};
  PerLane<std::int32_t> most_seen{};

  [[nodiscard]] bool is_kept(std::size_t lane) const {
    return least_seen[lane] >= low[lane] && most_seen[lane] <= high[lane];
  }
};

}  // namespace isohf
