#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "isohf/archive/codec/tile_payload.h"

/// What tiles that are decoded side by side are predicted from: rows of all lanes' samples, and weights.

namespace isohf {

/// Tiles that are decoded side by side, one in each lane of the machine's registers: a tile's samples wait for the one
/// before, the samples of other tiles do not.
inline constexpr std::size_t kBatchLanes = 8;

/// A value for each lane.
template <typename T>
using PerLane = std::array<T, kBatchLanes>;

inline constexpr int kBatchMargin = 3;

/// The range of each lane's samples, and the least and the most that a row had.
struct BatchRange {
  PerLane<std::int32_t> low{};
  PerLane<std::int32_t> high{};
  PerLane<std::int32_t> least_seen{};
  PerLane<std::int32_t> most_seen{};

  [[nodiscard]] bool is_kept(std::size_t lane) const {
    return least_seen[lane] >= low[lane] && most_seen[lane] <= high[lane];
  }
};

/// The rows that a sample is predicted from: its own and the three North of it.
enum class BatchRow : std::uint8_t { kOwn, kNorth, kFar, kFarther };

/// Those rows, lane by lane at each place, and what a row is restored with. On odd rows' North and farther rows a place
/// is that of the neighbour North-East.
template <typename Zigzagged>
struct BatchRows {
  std::int32_t* own;
  const std::int32_t* north;
  const std::int32_t* far;
  const std::int32_t* farther;
  const Zigzagged* zigzagged;
  const std::uint8_t* is_void;  ///< by place and lane; told where a lane has voids in the row

  /// Of a row above the sample's own.
  [[nodiscard]] const std::int32_t* above(BatchRow row) const {
    return row == BatchRow::kNorth ? north : row == BatchRow::kFar ? far : farther;
  }
};

/// The last four rows of all lanes, by place and lane, with kBatchMargin places more West and East.
class BatchRing {
 public:
  static constexpr std::ptrdiff_t kStep = kBatchLanes;

  explicit BatchRing(int columns)
      : stride_(kStep * (columns + 2 * kBatchMargin)), values_(4 * static_cast<std::size_t>(stride_)) {}

  /// Place 0 of row r, which is among the last four; row -1 and those North of it are as fill() left them.
  [[nodiscard]] std::int32_t* row(int r) { return values_.data() + offset(r); }
  [[nodiscard]] const std::int32_t* row(int r) const { return values_.data() + offset(r); }

  /// One lane's value at every place.
  void fill(std::size_t lane, std::int32_t value) {
    for (std::size_t i = lane; i < values_.size(); i += kBatchLanes) values_[i] = value;
  }

  template <typename Zigzagged>
  [[nodiscard]] BatchRows<Zigzagged> around(int r, const Zigzagged* zigzagged, const std::uint8_t* is_void) {
    const std::ptrdiff_t east = r % 2 * kStep;
    return {row(r), row(r - 1) + east, row(r - 2), row(r - 3) + east, zigzagged, is_void};
  }

 private:
  [[nodiscard]] std::ptrdiff_t offset(int r) const { return (r & 3) * stride_ + kStep * kBatchMargin; }

  std::ptrdiff_t stride_;
  std::vector<std::int32_t> values_;
};

/// The weights of all lanes along a row: one stretch of places where no lane has a map of blocks, one a block where
/// some have.
template <typename Weights>
class BatchStretches {
 public:
  explicit BatchStretches(int columns) : columns_(columns) {}

  /// Lanes are opened in order. The header must outlive this.
  void open(const PayloadHeader& header) {
    headers_.push_back(&header);
    is_wide_ |= header.predictors.is_wide;
  }

  [[nodiscard]] std::size_t lanes() const { return headers_.size(); }
  /// Whether a lane has more than the near weights.
  [[nodiscard]] bool is_wide() const { return is_wide_; }

  /// Gathers the weights for row r where they are not those of the row above:
  /// put(Weights&, lane, PredictorWeights, NE's weight) for each stretch and lane.
  template <typename Put>
  void take_row(int r, Put put) {
    if (r > 3 && r % kBlockPlaces != 0) return;
    const bool has_map = r > 2 && std::any_of(headers_.begin(), headers_.end(), [](const PayloadHeader* header) {
                           return !header->predictors.map.empty();
                         });
    weights_.assign(has_map ? static_cast<std::size_t>(Predictors::blocks_across(columns_)) : 1, Weights{});
    for (std::size_t stretch = 0; stretch < weights_.size(); ++stretch) {
      for (std::size_t lane = 0; lane < headers_.size(); ++lane) {
        const PredictorWeights& of_lane = headers_[lane]->predictors.of_block(r, stretch);
        std::int32_t anchor = 1 << kWeightBits;
        for (const std::int16_t weight : of_lane) anchor -= weight;
        put(weights_[stretch], lane, of_lane, anchor);
      }
    }
  }

  /// restore(Weights, begin, end) for the places of each stretch among first <= place <= last, from West to East.
  template <typename Restore>
  void for_each(int first, int last, Restore restore) const {
    for (std::size_t stretch = 0; stretch < weights_.size(); ++stretch) {
      const int begin = std::max(first, static_cast<int>(stretch) * kBlockPlaces);
      const bool is_last = stretch + 1 == weights_.size();
      const int end = is_last ? last + 1 : std::min(last + 1, static_cast<int>(stretch + 1) * kBlockPlaces);
      restore(weights_[stretch], begin, end);
    }
  }

 private:
  int columns_;
  bool is_wide_ = false;
  std::vector<const PayloadHeader*> headers_;
  std::vector<Weights> weights_;
};

}  // namespace isohf
