#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// How the encoder cuts the residuals of a tile into contexts by activity: so many as pay for their tables.

namespace isohf {

/// A residual, ready to be sorted into its context.
struct CodedResidual {
  std::uint32_t folded;
  std::uint32_t activity;
};

struct ContextChoice {
  std::uint8_t activity_shift = 0;
  std::vector<std::uint16_t> thresholds;
};

/// Deterministic; integers only.
[[nodiscard]] ContextChoice choose_contexts(std::span<const CodedResidual> residuals);

}  // namespace isohf
