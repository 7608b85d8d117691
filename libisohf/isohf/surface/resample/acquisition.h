#pragma once

#include <string>
#include <vector>

#include "isohf/surface/resample/kernels.h"

namespace isohf {

/// What the sensor or producer did to the terrain before it sampled it: the filter phi of which every source sample is
/// one reading, sample(k) = integral of phi(x) height(k - x) dx, along columns and rows alike. Distances are in source
/// samples. phi is even and integrates to 1.
struct Acquisition {
  enum class Kind {
    kPoint,     ///< the height at the sample's place
    kBox,       ///< the mean over the sample's own area
    kTent,      ///< the mean weighted by a tent two samples wide
    kGaussian,  ///< the mean weighted by a normal density of standard deviation `sigma`
    kFir,       ///< a weighted mean of point readings, one sample apart
  };
  Kind kind = Kind::kPoint;
  double sigma = 0.0;        ///< kGaussian: > 0
  std::vector<double> taps;  ///< kFir: odd count, symmetric, sum 1; the middle one belongs to the sample's own place
  std::string path;          ///< kFir: the file it came from, for to_string and messages
};

/// "point", "box", "tent", "gaussian:SIGMA" (in source samples, 0 < SIGMA <= 100) or "fir:PATH".
/// Reads the FIR file: text, numbers apart by white space, '#' starts a comment that goes on to the line's end; an odd
/// count of at most 255, symmetric (the reconstruction could not be mirrored at the raster's edges otherwise), with a
/// sum other than 0, by which they are divided.
/// Throws Error{kInvalidArgument} for any other text or contents, Error{kIo} where the file cannot be read.
[[nodiscard]] Acquisition acquisition_from_string(const std::string& text);
/// The inverse of acquisition_from_string; the shortest SIGMA that reads back as the same number.
[[nodiscard]] std::string to_string(const Acquisition& acquisition);
/// The contents of a FIR file; `path` only appears in messages and in the result.
[[nodiscard]] Acquisition fir_from_text(const std::string& text, const std::string& path);

/// The kernel as the acquisition sees it, (phi * kernel)(k) for k = 0, 1, ...: what a coefficient 1 at place 0 adds to
/// the reading at place k. Even in k; the values at all k, negative ones included, sum to 1. By Gauss-Legendre
/// quadrature on the pieces between knots: exact but for rounding for piecewise polynomials, else to 1e-14.
[[nodiscard]] std::vector<double> sampled_response(const Kernel& kernel, const Acquisition& acquisition);

}  // namespace isohf
