#pragma once

#include "isohf/surface/resample/kernels.h"
#include "isohf/surface/resample/prefilter.h"
#include "isohf/surface/source/source_statistics.h"

namespace isohf {

/// The most by which a reconstruction can leave the range of its samples: every value of a surface made of samples in
/// [a, b] lies in [a - m(b-a), b + m(b-a)], where m is returned. 0 for kernels that stay within the range of the
/// samples around, by their weights or by their limits. Holds for rasters without voids that are larger than the
/// prefilter's halo and the kernel along both axes.
///
/// m = (L^2 - 1)/2 with L the Lebesgue constant of the kernel with its prefilter, max over u of sum |weight of sample k
/// at u|, at the ends of a row as well, taken at 256 places between two samples and rounded up by a hundredth.
[[nodiscard]] double overshoot(const Kernel& kernel, const Prefilter& prefilter);

/// `range` widened by `fraction` of its length at both ends.
[[nodiscard]] ElevationRange widened(const ElevationRange& range, double fraction);

}  // namespace isohf
