#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace isohf {

/// Zigzagged residuals of codes from symbols, not paired, and their extra bits: the fast twin of the plain decoder's
/// loop. `extra` must be followed by kExpanderSlack more bytes that
/// may be read. Returns how many extra bits were taken, or nothing (all bits set) where a symbol does not exist or the
/// bits run out.
inline constexpr std::uint64_t kNotExpanded = ~std::uint64_t{0};
inline constexpr std::size_t kExpanderSlack = 32;
[[nodiscard]] std::uint64_t expand_residuals(std::span<const std::byte> symbols, std::span<const std::byte> extra,
                                             std::uint64_t position, std::uint16_t* zigzagged);

}  // namespace isohf
