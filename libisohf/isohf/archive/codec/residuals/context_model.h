#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

/// How the encoder cuts the residuals of a tile into contexts by activity: so many as pay for their tables.

namespace isohf {

/// How many residuals there are of each activity: [kActivityLimit].
[[nodiscard]] std::vector<std::uint32_t> count_activities(std::span<const std::uint16_t> activities);

/// Thresholds between contexts, ascending, for residuals given as symbols and activities in the same order, `histogram`
/// being count_activities of these. In large tiles one residual in `thinning` takes part. Deterministic; integers only.
[[nodiscard]] std::vector<std::uint16_t> choose_thresholds(std::span<const std::uint8_t> symbols,
                                                           std::span<const std::uint16_t> activities,
                                                           std::span<const std::uint32_t> histogram,
                                                           std::size_t thinning);

}  // namespace isohf
