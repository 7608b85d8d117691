// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace isohf {

/// Reconstruction kernels: how a height between samples follows from the samples around it.
enum class Filter { kNearest, kBilinear, kLimitedCubic, kBspline3 };

/// "nearest", "bilinear", "limited-cubic", "bspline3".
[[nodiscard]] std::string to_string(Filter filter);
/// The inverse of to_string; throws Error{kInvalidArgument} naming all of them for any other text.
[[nodiscard]] Filter filter_from_string(const std::string& text);

/// What convert() uses by default (docs/decisions/0027).
inline constexpr Filter kDefaultFilter = Filter::kLimitedCubic;

/// How a row of samples goes on beyond its ends, and into voids, for taps that reach there.
enum class Edges {
  kOdd,  ///< s[-k] = 2 s[0] - s[k], mirrored at the last sample as a point: planes stay planes
  kHeld,  ///< the same, and next to voids held near the samples around the place: at most a quarter of their range beyond it
};

[[nodiscard]] std::string to_string(Edges edges);                ///< "odd", "odd-held"
[[nodiscard]] Edges edges_from_string(const std::string& text);  ///< throws Error{kInvalidArgument}
/// What convert() does: kHeld for kBspline3, kOdd for filters whose result it does not change.
[[nodiscard]] Edges usual_edges(Filter filter);

/// What the sensor or producer did to the terrain before it sampled it: the filter phi of which every source sample is
/// one reading, sample(k) = integral of phi(x) height(k - x) dx, along columns and rows alike. Distances are in source
/// samples. phi is even and integrates to 1.
struct Acquisition {
  enum class Kind {
    kPoint,     ///< the height at the sample's position
    kBox,       ///< the mean over the sample's own area
    kGaussian,  ///< the mean weighted by a normal density of standard deviation `sigma`
    kTaps,      ///< a weighted mean of point readings, one sample apart
  };
  Kind kind = Kind::kPoint;
  double sigma = 0.0;  ///< kGaussian: above 0, at most 100
  /// kTaps: an odd number of at most 255, symmetric (the reconstruction could not be mirrored at the raster's edges
  /// otherwise); the middle one belongs to the sample's own position. They are divided by their sum, which is not 0.
  std::vector<double> taps;
};

/// "point", "box", "gaussian:SIGMA" or taps as in "0.25,0.5,0.25". Throws Error{kInvalidArgument} for any other text.
[[nodiscard]] Acquisition acquisition_from_string(const std::string& text);
/// The inverse; the shortest numbers that read back as the same ones.
[[nodiscard]] std::string to_string(const Acquisition& acquisition);

}  // namespace isohf
