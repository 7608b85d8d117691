#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "isohf/archive/lane_residuals.h"
#include "isohf/archive/tile_payload.h"

namespace isohf {

/// What a stretch of places is predicted with: a pair of weights of each lane, one pair of neighbours after the other.
inline constexpr std::size_t kLaneTermPairs = 11;
using StretchWeights = std::array<PerLane<std::int32_t>, kLaneTermPairs>;

/// The range of each lane's samples, and the least and the most that the row had; shifted (lane_samples.cpp).
struct LaneRange {
  PerLane<std::int32_t> low{};
  PerLane<std::int32_t> high{};
  PerLane<std::int32_t> least_seen{};
  PerLane<std::int32_t> most_seen{};
};

/// The samples of tiles that are decoded side by side, on their way from residuals to codes, row by row.
class LaneSamples {
 public:
  explicit LaneSamples(const TileShape& shape);

  /// Lanes are opened in order. The header must outlive this.
  void open(const PayloadHeader& header);

  /// Restores row r from the residuals taken last.
  void restore_row(int r, const LaneResiduals& residuals);

  /// Whether no sample of that row has left its lane's range.
  [[nodiscard]] bool is_in_range(std::size_t lane) const {
    return range_.least_seen[lane] >= range_.low[lane] && range_.most_seen[lane] <= range_.high[lane];
  }

  /// A lane's code at a place of row r, which is among the last three.
  [[nodiscard]] std::int32_t code(int r, int place, std::size_t lane) const;

  /// Writes row r by place, each lane's codes to where those of its place 0 stand; columns of slid vertices get nothing
  /// of use. All lanes need a place to write to, also those without a tile.
  void write_row(int r, const PerLane<std::uint16_t*>& codes) const;

 private:
  [[nodiscard]] std::int32_t* row(int r) { return samples_.data() + offset(r); }
  [[nodiscard]] const std::int32_t* row(int r) const { return samples_.data() + offset(r); }
  [[nodiscard]] std::ptrdiff_t offset(int r) const {
    return (r & 3) * stride_ + static_cast<std::ptrdiff_t>(kDecoderLanes) * kLaneMargin;
  }
  void gather_weights(int r);

  int columns_;
  std::ptrdiff_t stride_;
  bool is_wide_ = false;
  LaneRange range_;
  std::vector<const PayloadHeader*> headers_;
  std::vector<std::int32_t> samples_;  ///< four rows, by place and lane, in pairs
  std::vector<StretchWeights> weights_;
};

}  // namespace isohf
