#pragma once

#include "isohf/surface/kernels.h"
#include "isohf/surface/prefilter.h"
#include "isohf/surface/source_scan.h"

namespace isohf {

/// The most by which a reconstruction can leave the range of its samples: every value of a surface made of samples in
/// [a, b] lies in [a - m(b-a), b + m(b-a)], where m is returned. 0 for kernels without negative weights.
///
/// m = (L^2 - 1)/2 with L the Lebesgue constant of the kernel with its prefilter, max over u of sum |weight of sample k
/// at u|, taken at 256 places between two samples and rounded up by a hundredth.
[[nodiscard]] double overshoot(const Kernel& kernel, const Prefilter& prefilter);

/// `range` widened by `fraction` of its length at both ends.
[[nodiscard]] ElevationRange widened(const ElevationRange& range, double fraction);

}  // namespace isohf
