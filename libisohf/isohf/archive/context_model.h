#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// How the encoder cuts the residuals of a tile into contexts by activity: so many as pay for their tables.

namespace isohf {

/// The shift that brings activities to levels of which the mean is near 2^8.
[[nodiscard]] std::uint8_t choose_activity_shift(std::span<const std::uint32_t> activities);

/// How many residuals there are of each level: [kActivityLimit].
[[nodiscard]] std::vector<std::uint32_t> count_levels(std::span<const std::uint16_t> levels);

/// Thresholds between contexts, ascending, for residuals given as symbols and levels in the same order, `histogram`
/// being count_levels of these. Deterministic; integers only.
[[nodiscard]] std::vector<std::uint16_t> choose_thresholds(std::span<const std::uint8_t> symbols,
                                                           std::span<const std::uint16_t> levels,
                                                           std::span<const std::uint32_t> histogram);

}  // namespace isohf
