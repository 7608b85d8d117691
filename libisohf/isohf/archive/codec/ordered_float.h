#pragma once

#include <bit>
#include <cstdint>

namespace isohf {

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

}  // namespace isohf
