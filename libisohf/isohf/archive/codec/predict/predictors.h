#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// The weights that a tile's samples are predicted with (hex_predictor.h), and where on the tile which of them hold.

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

inline constexpr std::size_t kMaxPredictors = 8;
inline constexpr int kBlockPlaces = 16;  ///< a block of places that share a predictor: so many wide and high

/// The weights of a tile, and which of them hold where.
struct Predictors {
  std::vector<PredictorWeights> weights = {kThirdRowWeights};  ///< 1 to kMaxPredictors
  bool is_wide = false;                                        ///< all weights count, not only the near ones
  std::vector<std::uint8_t> map;  ///< block by block, row by row, an index into weights; empty where there is one
  int block_columns = 0;

  [[nodiscard]] static int blocks_across(int places) { return (places + kBlockPlaces - 1) / kBlockPlaces; }
  [[nodiscard]] const PredictorWeights& of_row(int r) const {
    return r == 0 ? kFirstRowWeights : r == 1 ? kSecondRowWeights : kThirdRowWeights;
  }
  /// The weights of row r in one of the blocks that it runs through.
  [[nodiscard]] const PredictorWeights& of_block(int r, std::size_t block_column) const {
    if (r <= 2) return of_row(r);
    if (map.empty()) return weights.front();
    return weights[map[static_cast<std::size_t>(r / kBlockPlaces * block_columns) + block_column]];
  }
  /// Calls `use(weights, begin, end)` for stretches of places [begin, end) that have the same weights, from `first` to
  /// `last` of row r.
  template <typename Use>
  void for_stretches(int r, int first, int last, const Use& use) const {
    if (r <= 2) return use(of_row(r), first, last + 1);
    if (map.empty()) return use(weights.front(), first, last + 1);
    const std::uint8_t* const row = map.data() + static_cast<std::ptrdiff_t>(r / kBlockPlaces) * block_columns;
    for (int begin = first; begin <= last;) {
      int block = begin / kBlockPlaces;
      const std::uint8_t index = row[block];
      while (block < block_columns && row[block] == index) ++block;
      const int end = std::min(block * kBlockPlaces, last + 1);
      use(weights[index], begin, end);
      begin = end;
    }
  }
};

}  // namespace isohf
