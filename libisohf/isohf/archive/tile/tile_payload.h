#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "isohf/archive/tile/predict/predictors.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/bytes.h"

/// What stands in a tile's payload: its header and the symbols of its contexts
/// (docs/archive_format.md, "Tile payload").

namespace isohf {

inline constexpr std::uint8_t kCodecVersion = 1;
inline constexpr std::size_t kMaxContexts = 16;
/// Bytes of the header of a payload whose samples are not all equal, without weights and contexts.
inline constexpr std::size_t kPredictedHeaderBytes = 30;

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
  std::uint8_t energy_shift = 0;
  std::uint8_t dropped_bits = 0;  ///< kF32: low bits of the float that are zero everywhere
  Predictors predictors;
  std::vector<std::uint16_t> thresholds;     ///< one fewer than contexts, ascending
  std::vector<std::uint32_t> symbol_counts;  ///< one for each context
  std::uint16_t paired = 0;                  ///< bit k: context k's symbols are stored in pairs (pair_coding.h)
};

/// Appends the header: 16 bytes, and where the samples differ the rest of it. The mask comes behind it.
void write_payload_header(const PayloadHeader& header, std::vector<std::byte>& out);

/// Reads a header, the void mask left out, and checks all that it says against itself and the shape.
/// Throws Error{kCorrupt, kUnsupported}.
[[nodiscard]] PayloadHeader read_payload_header(const TileShape& shape, CodeType type, ByteReader& reader);

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

/// The void mask of a tile as run lengths: samples that are known, samples that are void, and so on in turn, in storage
/// order; each length as a LEB128 number. Only the first may be 0; they add up to the number of samples. `is_void` holds 0
/// or 1 for each sample.
[[nodiscard]] std::vector<std::byte> pack_void_mask(std::span<const std::uint8_t> is_void);

/// Throws Error{kCorrupt} where the runs do not add up to `samples` or are not as pack_void_mask makes them.
[[nodiscard]] std::vector<std::uint8_t> unpack_void_mask(std::span<const std::byte> packed, std::size_t samples);

}  // namespace isohf
