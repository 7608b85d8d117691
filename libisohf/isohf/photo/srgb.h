#pragma once

#include <array>
#include <cstdint>

namespace isohf {

/// Light 0...1 of each 8-bit sRGB value (IEC 61966-2-1).
[[nodiscard]] const std::array<float, 256>& linear_from_srgb();

/// The 8-bit sRGB value nearest to `light` on the sRGB scale; 0 and 255 beyond 0...1, 0 for NaN. Exact: the inverse of
/// linear_from_srgb, and monotone.
[[nodiscard]] std::uint8_t srgb_from_linear(float light);

}  // namespace isohf
