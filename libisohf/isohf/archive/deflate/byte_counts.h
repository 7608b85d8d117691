#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace isohf {

using ByteCounts = std::array<std::uint32_t, 256>;

/// How often each byte occurs.
[[nodiscard]] ByteCounts count_bytes(std::span<const std::byte> bytes);

}  // namespace isohf
