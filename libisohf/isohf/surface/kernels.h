#pragma once

#include <array>
#include <cstdint>
#include <string>

namespace isohf {

/// Reconstruction kernels: how a height between samples follows from the samples around it.
enum class Filter { kNearest, kBilinear, kCatmullRom, kBspline2, kBspline3, kBspline5, kLanczos3, kLanczos6 };

/// "nearest", "bilinear", "catmull-rom", "bspline2", "bspline3", "bspline5", "lanczos3", "lanczos6".
[[nodiscard]] std::string to_string(Filter filter);
/// The inverse of to_string; throws Error{kInvalidArgument} naming all of them for any other text.
[[nodiscard]] Filter filter_from_string(const std::string& text);

inline constexpr int kMaxTaps = 12;

/// The part of a kernel that acts at one position: value(u) = sum over i < taps of weights[i] * c[first + i].
/// The weights sum to 1 up to their rounding to float; those from `taps` on are 0.
struct TapWeights {
  std::int64_t first;
  std::array<float, kMaxTaps> weights;
};

/// A separable kernel, applied along columns and along rows; sample k lies at position u = k.
///
/// The coefficients c are the samples themselves where interpolates() holds and the acquisition is a point, else the
/// output of the matching Prefilter: a B-spline without its prefilter blurs.
///
/// How to evaluate in two dimensions, with tap weights w[i] along the columns and v[j] along the rows:
///   1. Beyond the raster's true ends a tap reads the mirrored coefficient (mirror_index). It is not a void.
///   2. A point is void where all samples around it (columns floor(u) and ceil(u), rows likewise) are void.
///   3. Let W = sum of w[i] v[j] over the taps whose sample is not void. A point with W < 1/2 is void.
///   4. The value is the sum of w[i] v[j] c[i, j]. Where some of these coefficients are NaN, they are left out and the
///      sum is divided by the weight of the others; a Prefilter leaves none NaN where rule 2 holds, so that happens
///      only to samples that are their own coefficients.
/// W is the plain sum, negative lobes included: the weights of the taps that were dropped then sum to at most 1/2, and
/// the result stays an affine combination of heights, exact on level ground.
class Kernel {
 public:
  [[nodiscard]] static Kernel make(Filter filter);

  [[nodiscard]] Filter filter() const { return filter_; }
  /// Number of coefficients that one position reads: 1, 2, 3, 4, 6 or 12.
  [[nodiscard]] int taps() const { return taps_; }
  /// True where the kernel is 1 at 0 and 0 at all other integers, so that samples are their own coefficients.
  [[nodiscard]] bool interpolates() const;
  /// The kernel vanishes for |x| >= support().
  [[nodiscard]] double support() const { return 0.5 * taps_; }

  /// Weights at position u, |u| < 2^52: a pure function of u, computed in double and rounded to float once.
  /// Nearest gives a tie, u = k + 1/2, to sample k + 1.
  [[nodiscard]] TapWeights at(double u) const;

  /// The kernel itself, in double: the weight at position x of a sample at 0. Even; nearest is 1 on [-1/2, 1/2).
  [[nodiscard]] double value(double x) const;

 private:
  Kernel(Filter filter, int taps) : filter_(filter), taps_(taps) {}

  Filter filter_;
  int taps_;
};

/// The sample that stands in for sample k of a row of `count`: whole-sample mirror at both ends, ... 2 1 0 1 2 ...
/// count >= 1; any k.
[[nodiscard]] std::int64_t mirror_index(std::int64_t k, std::int64_t count);

}  // namespace isohf
