#pragma once

#include <cstdint>
#include <vector>

#include "isohf/base/view.h"
#include "isohf/sampling/resample/acquisition.h"
#include "isohf/sampling/resample/kernels.h"

namespace isohf {

/// Turns samples into the coefficients of a kernel, so that reading the reconstruction through the acquisition filter
/// at the source's places returns the source (Unser and Aldroubi 1994: consistent sampling).
///
/// Along each axis it is the inverse of the sequence a[k] = (phi * kernel)(k). For a point acquisition and a B-spline
/// that is Unser's recursive prefilter; a box gives the one of degree n + 1. Here it is applied as the
/// inverse's impulse response p[k], symmetric and cut off where what is left out sums to less than 1e-9. Each
/// coefficient so depends on halo() samples on either side and on nothing else: however the work is cut into bands or
/// blocks, the bits are the same. Sums are double, in order of k, and rounded to float once for each axis.
///
/// Voids are NaN and never read as numbers: each run of samples is filtered alone, continued at its ends as the source
/// is at its own (continue_row).
///
///   samples        . . . . . . . s s s s s s . . s s s s s . . . . . . .      . void    s sample
///   coefficients   . . . . b b b c c c c c c l l c c c c c b b b . . . .      c of a sample
///
/// The surface goes on by border() places into the voids (b), continued like the run, and straight across gaps of at
/// most twice that (l), along rows and then along columns. So a kernel finds all its coefficients wherever a sample is
/// next to it, and every sample keeps its height, next to voids too; voids must be told from the samples, no longer
/// from the coefficients.
///
/// The work is shared among the threads of the caller's task arena.
class Prefilter {
 public:
  /// The inverse exists and is stable where the spectrum of a is positive. It is refused, Error{kInvalidArgument} with
  /// the gain and its frequency, where the acquisition is to be amplified more than kMostGain times along one axis.
  [[nodiscard]] static Prefilter make(Filter filter, const Acquisition& acquisition);

  static constexpr double kMostGain = 100.0;

  /// Instead of that a mean of the samples around, along each axis by the weights 1 6 15 20 15 6 1 / 64. Voids are as
  /// above, and no place beyond a sample receives a coefficient.
  [[nodiscard]] static Prefilter smoothing();

  /// True where samples are their own coefficients; the functions below then only copy.
  [[nodiscard]] bool is_identity() const { return taps_.size() == 1; }
  /// Samples on either side that one coefficient depends on: 0 for the identity, 20 for bspline3.
  [[nodiscard]] int halo() const { return static_cast<int>(taps_.size()) - 1 + 2 * border_; }
  /// Places beyond a sample, into voids, that receive coefficients: half the kernel's taps; 0 for the identity.
  [[nodiscard]] int border() const { return border_; }
  /// p[k] for k = 0, 1, ...; even.
  [[nodiscard]] const std::vector<double>& impulse_response() const { return taps_; }

  /// Along every row of a band of whole rows, in place. `wraps`: the sample behind a row's last one is its first, and
  /// no end is continued.
  void filter_rows(View2D<float> band, bool wraps = false) const;

  /// Along every column: out row r receives the coefficients of band row `first` + r.
  /// band  the rows to filter and halo() more on either side, or all that the source has there: where the band ends
  ///       nearer than halo() to a row of out, its end counts as the source's end
  /// out   as many columns as band, rows within it; either apart from band or exactly those rows of it
  void filter_columns(View2D<const float> band, std::int64_t first, View2D<float> out) const;

  /// The whole raster in place, rows first; what any cut into bands gives.
  void filter(View2D<float> raster) const;

 private:
  Prefilter(std::vector<double> taps, int border);

  std::vector<double> taps_;
  int border_;
};

}  // namespace isohf
