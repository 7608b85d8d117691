#pragma once

#include <vector>

#include "isohf/sampling/resample/kernels.h"

namespace isohf {

/// The acquisition as it is used: taps sum to 1. Throws Error{kInvalidArgument} if it is none.
[[nodiscard]] Acquisition with_taps(const Acquisition& acquisition);

/// The kernel as the acquisition sees it, (phi * kernel)(k) for k = 0, 1, ...: what a coefficient 1 at position 0 adds
/// to the reading at position k. Even in k; the values at all k, negative ones included, sum to 1. By Gauss-Legendre
/// quadrature on the pieces between knots: exact but for rounding for piecewise polynomials, else to 1e-14.
[[nodiscard]] std::vector<double> sampled_response(const Kernel& kernel, const Acquisition& acquisition);

}  // namespace isohf
