#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// How the encoder cuts the residuals of a tile into contexts by energy: so many as pay for their tables.

namespace isohf {

/// How many residuals there are of each energy: [kEnergyLimit].
[[nodiscard]] std::vector<std::uint32_t> count_energies(std::span<const std::uint16_t> energies);

/// Thresholds between contexts, ascending, for residuals given as symbols and energies in the same order, `histogram`
/// being count_energies of these. In large tiles one residual in `thinning` takes part. Deterministic; integers only.
[[nodiscard]] std::vector<std::uint16_t> choose_thresholds(std::span<const std::uint8_t> symbols,
                                                           std::span<const std::uint16_t> energies,
                                                           std::span<const std::uint32_t> histogram,
                                                           std::size_t thinning);

}  // namespace isohf
