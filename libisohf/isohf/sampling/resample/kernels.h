#pragma once

#include <array>
#include <cstdint>

#include "isohf/resampling.h"

namespace isohf {

inline constexpr int kMaxTaps = 4;

/// The part of a kernel that acts at one position: value(u) = sum over i < taps of weights[i] * c[first + i].
/// The weights sum to 1 up to their rounding to float; those from `taps` on are 0.
struct TapWeights {
  std::int64_t first;
  std::array<float, kMaxTaps> weights;
};

/// A separable kernel, applied along columns and along rows; sample k lies at position u = k.
///
/// The coefficients c are the output of the matching Prefilter: a B-spline without its prefilter blurs. They are the
/// samples themselves if the acquisition is a point and the kernel is 1 at 0 and 0 at all other integers, as all but
/// the B-spline are.
///
/// How to evaluate in two dimensions, with tap weights w[i] along the columns and v[j] along the rows:
///   1. Beyond the raster's true ends a tap reads what stands in there by edges() (continue_row). It is not a void.
///   2. A point has a height by rule 4 unless all samples around it (columns floor(u) and ceil(u), rows likewise) are
///      void.
///   3. Let W = sum of w[i] v[j] over the taps whose sample is not void. Rule 4 needs W >= 1/2. Any other vertex of a
///      lattice has a height by rule 7, or is void.
///   4. The value is the sum of w[i] v[j] c[i, j]. Where some of these coefficients are NaN, they are left out and the
///      sum is divided by the weight of the others; a Prefilter leaves none NaN where rule 2 holds, so that happens
///      only to samples that are their own coefficients. But with four samples around the
///      point that are no voids, nothing is left out: the missing taps are continued
///      like those beyond the raster's ends, first along each row whose two middle taps are samples, then row by row.
///   5. With Edges::kHeld and four taps, where a tap's sample is a void: of the four samples around the point
///      those that are no voids, as the kernel reconstructs them, have a range; a value farther beyond it than a
///      quarter of it is moved to there.
///   6. Where is_limited(), a value beyond the range of the four samples around the point (of those that are no voids)
///      is moved to its end.
///   7. A vertex that is a corner of a triangle with a valid sample lies beside it (LatticeAround): it has the height of a
///      plane through the valid samples around. So no sample loses its surface to voids nearby.
/// W is the plain sum, negative lobes included: the weights of the taps that were dropped then sum to at most 1/2, and
/// the result stays an affine combination of heights, exact on level ground.
class Kernel {
 public:
  [[nodiscard]] static Kernel make(Filter filter, Edges edges);
  [[nodiscard]] static Kernel make(Filter filter) { return make(filter, usual_edges(filter)); }

  [[nodiscard]] Filter filter() const { return filter_; }
  [[nodiscard]] Edges edges() const { return edges_; }
  /// Rule 6 above.
  [[nodiscard]] bool is_limited() const { return filter_ == Filter::kLimitedCubic; }
  /// Number of coefficients that one position reads: 1, 2 or 4.
  [[nodiscard]] int taps() const { return taps_; }
  /// The kernel vanishes for |x| >= support().
  [[nodiscard]] double support() const { return 0.5 * taps_; }

  /// Weights at position u, |u| < 2^52: a pure function of u, computed in double and rounded to float once.
  /// Nearest gives a tie, u = k + 1/2, to sample k + 1.
  [[nodiscard]] TapWeights at(double u) const;

  /// The kernel itself, in double: the weight at position x of a sample at 0. Even; nearest is 1 on [-1/2, 1/2).
  [[nodiscard]] double value(double x) const;

 private:
  Kernel(Filter filter, int taps, Edges edges) : filter_(filter), taps_(taps), edges_(edges) {}

  Filter filter_;
  int taps_;
  Edges edges_;
};

/// The sample that stands in for sample k of a row of `count`: whole-sample mirror at both ends, ... 2 1 0 1 2 ...
/// count >= 1; any k.
[[nodiscard]] std::int64_t mirror_index(std::int64_t k, std::int64_t count);

/// Calls use(index, weight), weight 1, 2, -1 or -2, for samples whose weighted sum stands in for sample k of a row of
/// `count`. count >= 1; any k.
template <typename Use>
void continue_row(std::int64_t k, std::int64_t count, Use use) {
  if (count == 1) return use(0, 1);
  int sign = 1;
  for (; k < 0 || k >= count; sign = -sign) {
    const std::int64_t end = k < 0 ? 0 : count - 1;
    use(end, 2 * sign);
    k = 2 * end - k;
  }
  use(k, sign);
}

}  // namespace isohf
