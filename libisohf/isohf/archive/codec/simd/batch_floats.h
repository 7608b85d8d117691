#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "isohf/archive/codec/simd/batch_residuals.h"
#include "isohf/archive/codec/simd/batch_rows.h"
#include "isohf/archive/codec/tile_payload.h"

namespace isohf {

/// A weight of each lane, and once more those of odd lanes where those of even ones stand: products of 32 by 32 bits
/// take their factors from there.
struct FloatWeights {
  PerLane<std::int32_t> all{};
  PerLane<std::int32_t> of_odd{};
};
/// What a stretch of places is predicted with, weight by weight; that of NE comes last.
using FloatStretch = std::array<FloatWeights, kWeightCount + 1>;

/// The samples of tiles of floats that are decoded side by side, on their way from residuals to floats, row by row:
/// what BatchCodes is for codes.
class BatchFloats {
 public:
  using Zigzagged = std::uint32_t;
  using Stored = float;

  explicit BatchFloats(const TileShape& shape);

  /// Lanes are opened in order. The header must outlive this.
  void open(const PayloadHeader& header);

  /// Restores row r from the residuals taken last.
  void restore_row(int r, const BatchResiduals<std::uint32_t>& residuals);

  /// Whether no sample of that row has left its lane's range.
  [[nodiscard]] bool is_in_range(std::size_t lane) const { return range_.is_kept(lane); }

  /// A lane's sample at a place of row r, which is among the last three.
  [[nodiscard]] std::int32_t sample(int r, int place, std::size_t lane) const {
    return ring_.row(r)[place * BatchRing::kStep + static_cast<std::ptrdiff_t>(lane)];
  }
  /// A sum as samples have it, and a sample as it is stored.
  [[nodiscard]] static std::int32_t wrapped(std::uint32_t sum) { return static_cast<std::int32_t>(sum); }
  [[nodiscard]] float stored(std::int32_t sample, std::size_t lane) const {
    return float_from_ordered(sample, static_cast<unsigned>(dropped_[lane]));
  }

  /// Writes row r by place, each lane's floats to where those of its place 0 stand; columns of slid vertices get
  /// nothing of use. All lanes need a place to write to, also those without a tile.
  void write_row(int r, const PerLane<float*>& heights) const;

 private:
  int columns_;
  BatchRange range_;
  PerLane<std::int32_t> dropped_{};
  BatchRing ring_;
  BatchStretches<FloatStretch> stretches_;
};

}  // namespace isohf
