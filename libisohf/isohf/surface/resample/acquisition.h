#pragma once

#include <string>
#include <vector>

#include "isohf/surface/resample/kernels.h"

namespace isohf {

/// The acquisition as it is used, held against its rules: with its taps, from its file where it has none: text, numbers
/// apart by white space, '#' starts a comment that goes on to the line's end; an odd count of at most 255, symmetric (the reconstruction could not be
/// mirrored at the raster's edges otherwise), with a sum other than 0, by which they are divided.
/// Throws Error{kInvalidArgument} for any other contents, Error{kIo} where the file cannot be read.
[[nodiscard]] Acquisition with_taps(const Acquisition& acquisition);
/// The contents of a FIR file; `path` only appears in messages and in the result.
[[nodiscard]] Acquisition fir_from_text(const std::string& text, const std::string& path);

/// The kernel as the acquisition sees it, (phi * kernel)(k) for k = 0, 1, ...: what a coefficient 1 at position 0 adds
/// to the reading at position k. Even in k; the values at all k, negative ones included, sum to 1. By Gauss-Legendre
/// quadrature on the pieces between knots: exact but for rounding for piecewise polynomials, else to 1e-14.
[[nodiscard]] std::vector<double> sampled_response(const Kernel& kernel, const Acquisition& acquisition);

}  // namespace isohf
