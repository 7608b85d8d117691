#pragma once

#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {

/// The Lebesgue constant of a kernel with its prefilter, max over u of sum |weight of sample k at u|, at the ends of a
/// row as well, taken at 256 places between two samples and rounded up by a hundredth.
[[nodiscard]] double lebesgue_constant(const Kernel& kernel, const Prefilter& prefilter);

/// The most by which a vertex's height, which is summed in single precision above `datum`, is off what the doubles of
/// the samples in `range` would make it. Holds on the source's ground; beside voids (whose weight is shared among the
/// others) it may be twice that, and beyond the source's edge, where a slope is continued along both axes, nine times.
///
/// With u = 2^-24, M the largest distance of a sample from the datum, T taps and L the kernel's Lebesgue constant, C the
/// largest coefficient:
///   - A sample's height is rounded once: u M.
///   - A prefilter, of impulse response p with G = (sum |p|)^2, amplifies that, and rounds after the rows and after the
///     columns: in all u G M, u G M and u C. C is M without a prefilter; with one it is taken for 3/2 M, which only
///     ground that goes up and down over most of its range from sample to sample exceeds.
///   - A kernel's weights are rounded once: 2u for a product of two. A sum of T products has each term rounded T times
///     at most, and once more where two samples stand in for one beyond the source's end: T + 1 along each axis. With
///     sum |w v c| <= L^2 C that is (2 (T + 1) + 2) u L^2 C.
/// Products of two u are left aside: L is rounded up by more.
[[nodiscard]] double height_error(const Kernel& kernel, const Prefilter& prefilter, const ElevationRange& range,
                                  double datum);

}  // namespace isohf
