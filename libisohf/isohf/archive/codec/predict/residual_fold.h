#pragma once

#include <cstdint>

namespace isohf {

/// Folded residuals of `count` samples, from predictions in halves (hex_predictor.h). own, halves, out [count]; `out`
/// is neither of the others.
void fold_row(const std::int32_t* own, const std::int32_t* halves, int count, std::uint16_t* out);
void fold_row(const std::int64_t* own, const std::int64_t* halves, int count, std::uint32_t* out);

}  // namespace isohf
