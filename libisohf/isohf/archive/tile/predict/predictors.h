#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

/// The weights that a tile's samples are predicted with (hex_predictor.h).

namespace isohf {

inline constexpr std::size_t kWeightCount = 18;
inline constexpr std::size_t kNearWeightCount = 12;  ///< the first so many are all that near prediction has
inline constexpr int kWeightBits = 12;               ///< weights are multiples of 2^-12
using PredictorWeights = std::array<std::int16_t, kWeightCount>;

/// Weights of the first three rows, which lack rows above: W; then W + NE - NW; then what terrain has on average.
inline constexpr PredictorWeights kFirstRowWeights = {4096};
inline constexpr PredictorWeights kSecondRowWeights = {4096, -4096};
inline constexpr PredictorWeights kThirdRowWeights = {4750, -1050, -1180, 370, -1230, 350, -1230, -290, 50, 660};

/// The sum of |weight| must stay below this, so that 16-bit samples are predicted in 32 bits: 28671 * 65534 + 4096 *
/// 65534 < 2^31.
inline constexpr int kWeightSumLimit = 7 << kWeightBits;

/// The weights of a tile.
struct Predictors {
  PredictorWeights weights = kThirdRowWeights;  ///< from the fourth row on
  bool is_wide = false;                         ///< all weights count, not only the near ones

  [[nodiscard]] const PredictorWeights& of_row(int r) const {
    return r == 0 ? kFirstRowWeights : r == 1 ? kSecondRowWeights : r == 2 ? kThirdRowWeights : weights;
  }
};

}  // namespace isohf
