#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "isohf/archive/codec/simd/batch_residuals.h"
#include "isohf/archive/codec/simd/batch_rows.h"
#include "isohf/archive/codec/tile_payload.h"

namespace isohf {

/// What a stretch of places is predicted with: a pair of weights of each lane, one pair of neighbours after the other.
inline constexpr std::size_t kTermPairCount = 11;
using StretchWeights = std::array<PerLane<std::int32_t>, kTermPairCount>;

/// The samples of tiles that are decoded side by side, on their way from residuals to codes, row by row.
class BatchCodes {
 public:
  using Zigzagged = std::uint16_t;
  using Stored = std::uint16_t;

  explicit BatchCodes(const TileShape& shape);

  /// Lanes are opened in order. The header must outlive this.
  void open(const PayloadHeader& header);

  /// Restores row r from the residuals taken last.
  void restore_row(int r, const BatchResiduals<std::uint16_t>& residuals);

  /// Whether no sample of that row has left its lane's range.
  [[nodiscard]] bool is_in_range(std::size_t lane) const { return range_.is_kept(lane); }

  /// A lane's sample at a place of row r, which is among the last three.
  [[nodiscard]] std::int32_t sample(int r, int place, std::size_t lane) const;
  /// A sum as samples have it, and a sample as it is stored.
  [[nodiscard]] static std::int32_t wrapped(std::uint32_t sum) { return static_cast<std::int32_t>(sum & 0xffffU); }
  [[nodiscard]] static std::uint16_t stored(std::int32_t sample, std::size_t) {
    return static_cast<std::uint16_t>(sample);
  }

  /// Writes row r by place, each lane's codes to where those of its place 0 stand; columns of slid vertices get nothing
  /// of use. All lanes need a place to write to, also those without a tile.
  void write_row(int r, const PerLane<std::uint16_t*>& codes) const;

 private:
  int columns_;
  BatchRange range_;  ///< shifted (batch_codes.cpp)
  BatchRing ring_;    ///< pairs of samples
  BatchStretches<StretchWeights> stretches_;
};

}  // namespace isohf
