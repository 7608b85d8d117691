#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "isohf/archive/tile/predict/predictors.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/bytes.h"

namespace isohf {

inline constexpr std::uint8_t kAdaptiveVersion = 2;
inline constexpr std::size_t kMostStates = 8;
inline constexpr std::uint32_t kFirstState = 1U << 16U;  ///< what an encoder starts from and a decoder ends with

/// A payload of version 2, as it stands in a tile (docs/archive_format.md, "Payload version 2").
struct AdaptivePayload {
  CodeType type = CodeType::kU16;
  std::int32_t low = 0;
  std::int32_t high = 0;
  std::int32_t base = 0;
  bool has_weights = false;  ///< else those of the third row hold for all
  Predictors predictors;
  std::vector<std::uint32_t> states;  ///< 1 or kMostStates
  std::vector<std::uint8_t> is_void;  ///< empty where nothing is void
  std::span<const std::byte> words;   ///< of two bytes each
  std::span<const std::byte> extra;
};

[[nodiscard]] inline bool is_adaptive(std::span<const std::byte> payload) {
  return !payload.empty() && payload[0] == std::byte{kAdaptiveVersion};
}

/// Appends a payload; `words` in the order in which they are read.
void write_adaptive_payload(const AdaptivePayload& payload, std::span<const std::uint16_t> words,
                            std::span<const std::byte> extra, std::vector<std::byte>& out);

/// Takes a payload apart and checks what its header says. Its bytes must outlive the result. Throws Error{kCorrupt}.
[[nodiscard]] AdaptivePayload read_adaptive_payload(const TileShape& shape, CodeType type,
                                                    std::span<const std::byte> bytes);

}  // namespace isohf
