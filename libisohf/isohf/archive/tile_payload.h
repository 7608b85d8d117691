#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "isohf/archive/hex_predictor.h"
#include "isohf/archive/tile_codec.h"
#include "isohf/base/bytes.h"

/// What encoder and decoder of a tile share: the payload's header, the samples' order, the residuals' symbols and the
/// contexts (docs/archive_format.md, "Tile payload").

namespace isohf {

inline constexpr std::uint8_t kCodecVersion = 1;
inline constexpr std::size_t kMaxContexts = 16;
inline constexpr std::size_t kFixedHeaderBytes = 16;      ///< of every payload
inline constexpr std::size_t kPredictedHeaderBytes = 30;  ///< of one whose samples are not all equal, without weights
                                                          ///< and contexts

/// The largest payload that a tile of this shape and type can have.
[[nodiscard]] std::uint64_t max_payload_bytes(const TileShape& shape, CodeType type);

struct PayloadHeader {
  CodeType type = CodeType::kU16;
  bool has_voids = false;
  bool is_constant = false;
  std::int32_t low = 0;  ///< smallest and largest sample that is not void
  std::int32_t high = 0;
  std::int32_t base = 0;  ///< stands for all samples above and West of the first
  std::uint32_t mask_bytes = 0;
  std::uint32_t extra_bytes = 0;
  std::uint8_t activity_shift = 0;
  std::uint8_t dropped_bits = 0;  ///< kF32: low bits of the float that are zero everywhere
  Predictors predictors;
  std::vector<std::uint16_t> thresholds;     ///< one fewer than contexts, ascending
  std::vector<std::uint32_t> symbol_counts;  ///< one for each context
  std::uint16_t paired = 0;                  ///< bit k: context k's symbols are stored in pairs (pair_coding.h)
};

/// Appends the header: 16 bytes, and where the samples differ the rest of it. Mask and map come behind it.
void write_payload_header(const PayloadHeader& header, std::vector<std::byte>& out);

/// Blocks that the map of a tile of this shape has.
[[nodiscard]] std::size_t block_count(const TileShape& shape);

/// Reads a header, void mask and map of predictors left out, and checks all that it says against itself and the shape.
/// Throws Error{kCorrupt, kUnsupported}.
[[nodiscard]] PayloadHeader read_payload_header(const TileShape& shape, CodeType type, ByteReader& reader);

/// Reads the map, which follows the mask where there are several predictors. Throws Error{kCorrupt}.
void read_block_map(const TileShape& shape, ByteReader& reader, Predictors& predictors);

/// The symbols of all contexts, unpaired.
class SymbolStreams {
 public:
  /// Reads what the header says that there is. Throws Error{kCorrupt}. The reader's bytes must outlive the streams.
  SymbolStreams(const PayloadHeader& header, ByteReader& reader);

  [[nodiscard]] std::span<const std::byte> operator[](std::size_t context) const { return streams_[context]; }

 private:
  std::array<std::span<const std::byte>, kMaxContexts> streams_{};
  std::unique_ptr<std::byte[]> unpaired_;
};

// --- samples ---

/// A float's place among all floats that have `dropped` zero low bits: order-preserving, -0.0 just below +0.0.
[[nodiscard]] inline std::int32_t ordered_from_float(float value, unsigned dropped) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  const auto magnitude = static_cast<std::int32_t>((bits & 0x7fffffffU) >> dropped);
  return bits >> 31U != 0 ? -magnitude - 1 : magnitude;
}

[[nodiscard]] inline float float_from_ordered(std::int32_t ordered, unsigned dropped) {
  const bool negative = ordered < 0;
  const std::uint32_t magnitude = static_cast<std::uint32_t>(negative ? -(ordered + 1) : ordered) << dropped;
  return std::bit_cast<float>(magnitude | (negative ? 0x80000000U : 0U));
}

// --- residuals ---

/// 0, -1, 1, -2, 2, ... to 0, 1, 2, 3, 4, ...
[[nodiscard]] inline std::uint32_t zigzag(std::int32_t residual) {
  return (static_cast<std::uint32_t>(residual) << 1U) ^ static_cast<std::uint32_t>(residual >> 31);
}
[[nodiscard]] inline std::uint32_t unzigzag(std::uint32_t folded) {
  return (folded >> 1U) ^ (0U - (folded & 1U));
}

/// A folded residual as a symbol and some bits more: itself below 16; above, eight symbols for every octave.
inline constexpr std::uint32_t kFirstSplitSymbol = 16;

[[nodiscard]] constexpr unsigned extra_bits_of_symbol(unsigned symbol) {
  return symbol < kFirstSplitSymbol ? 0U : (symbol - kFirstSplitSymbol) / 8 + 1;
}
[[nodiscard]] constexpr unsigned symbol_of(std::uint32_t folded) {
  if (folded < kFirstSplitSymbol) return folded;
  const auto octave = static_cast<unsigned>(std::bit_width(folded)) - 1;  // 4..31
  return kFirstSplitSymbol + (octave - 4) * 8 + ((folded >> (octave - 3)) & 7U);
}
[[nodiscard]] constexpr std::uint32_t folded_from(unsigned symbol, std::uint32_t extra) {
  if (symbol < kFirstSplitSymbol) return symbol;
  const unsigned bits = extra_bits_of_symbol(symbol);
  return ((8U + (symbol & 7U)) << bits) + extra;
}
/// One more than the last symbol of residuals of that many bits: 112 for 16, 240 for 32.
[[nodiscard]] constexpr unsigned symbol_limit(unsigned residual_bits) {
  return kFirstSplitSymbol + (residual_bits - 4) * 8;
}
[[nodiscard]] inline unsigned residual_bits(CodeType type) {
  return type == CodeType::kF32 ? 32U : 16U;
}

// --- contexts ---

/// How rough the tile is around a place, from the residuals of the two rows above it: a weighted sum of these, shifted
/// and limited, so that it needs no more than 12 bits. The rows above alone: a decoder knows the contexts of a whole
/// row before it reads a residual of it.
///
///     1 . 2 . 4 . 2 . 1      row r-2
///   1 . 2 . 4 . 4 . 3 . 2    row r-1
///              (x)
inline constexpr unsigned kActivityLimit = 4096;  ///< activities are below this
inline constexpr unsigned kActivityWeight = 26;   ///< sum of the weights
inline constexpr std::uint32_t kMagnitudeLimit = (kActivityLimit - 1) / kActivityWeight;

/// What a folded residual counts in activities.
[[nodiscard]] inline std::uint8_t magnitude(std::uint32_t folded, unsigned shift) {
  const std::uint32_t shifted = folded >> shift;
  return static_cast<std::uint8_t>(shifted < kMagnitudeLimit ? shifted : kMagnitudeLimit);
}
/// `north` as in prediction, so that north[place] is NE's; far[place] is NN's.
[[nodiscard]] inline std::uint16_t activity_of(const std::uint8_t* north, const std::uint8_t* far, int place) {
  const std::uint8_t* const n = north + place;
  const std::uint8_t* const f = far + place;
  return static_cast<std::uint16_t>(4 * (n[0] + n[-1] + f[0]) + 3 * n[1] + 2 * (n[2] + n[-2] + f[1] + f[-1]) + n[-3] +
                                    f[2] + f[-2]);
}
/// The same for a slid vertex, from the two lattice places beside it.
[[nodiscard]] inline std::uint16_t activity_of_slid(std::uint8_t west, std::uint8_t east) {
  return static_cast<std::uint16_t>(kActivityWeight / 2 * (unsigned{west} + east));
}

/// Activities of places first to last of a row.
void find_activities(const std::uint8_t* north, const std::uint8_t* far, int first, int last,
                     std::uint16_t* __restrict activities);

/// The context of every activity: how many thresholds it reaches.
[[nodiscard]] std::array<std::uint8_t, kActivityLimit> context_table(std::span<const std::uint16_t> thresholds);

/// Magnitudes of the row that is worked on and the two above it, with margins of three places.
class MagnitudeRows {
 public:
  explicit MagnitudeRows(int columns) : columns_(columns) {
    for (auto& row : rows_) row.resize(static_cast<std::size_t>(columns) + 2 * kMargin);
  }

  [[nodiscard]] std::uint8_t* current() { return rows_[0].data() + kMargin; }
  [[nodiscard]] const std::uint8_t* above() const { return rows_[1].data() + kMargin; }
  [[nodiscard]] const std::uint8_t* far_above() const { return rows_[2].data() + kMargin; }

  /// After a row: its margins repeat the outermost magnitudes, and it becomes the one above.
  void close_row(int first, int last) {
    std::uint8_t* const row = current();
    for (int place = -kMargin; place < first; ++place) row[place] = row[first];
    for (int place = last + 1; place < columns_ + kMargin; ++place) row[place] = row[last];
    rows_[2].swap(rows_[1]);
    rows_[1].swap(rows_[0]);
  }

 private:
  static constexpr int kMargin = 3;
  int columns_;
  std::array<std::vector<std::uint8_t>, 3> rows_;
};

/// What a void sample counts as while its neighbours are predicted: the mean of W and NE, rounded down.
template <typename Wide>
[[nodiscard]] inline Wide void_fill(const Wide* own, const Wide* north, int place) {
  return (own[place - 1] + north[place]) >> 1;
}

/// The column whose sample stands at a lattice place, and that of a slid vertex (even rows; 0 West, 1 East). A row is
/// coded place by place from West to East, an even row's slid vertices after it.
[[nodiscard]] inline int column_of_place(int columns, int row, int place) {
  if (row % 2 != 0) return place;
  if (place == 1) return 0;
  return place == columns - 2 ? columns - 1 : place;
}
[[nodiscard]] inline int column_of_slid(int columns, int side) {
  return side == 0 ? 1 : columns - 2;
}

}  // namespace isohf
