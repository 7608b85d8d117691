#pragma once

#include <complex>
#include <cstdint>
#include <vector>

#include "isohf/base/view.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"

namespace isohf {

/// A sum of waves that fit a square of n x n samples: wave vectors (i, j) with 0 < |(i, j)| <= rho n / 2, amplitude
/// |(i, j)|^-p, random phases from a fixed generator; known exactly everywhere.
class TrigonometricField {
 public:
  TrigonometricField(int n, double p, double rho, std::uint64_t seed);

  [[nodiscard]] int n() const { return n_; }
  /// Heights at columns first_u + i * step_u of the row at v.
  [[nodiscard]] std::vector<double> row(double v, double first_u, double step_u, int count) const;
  /// The field at the n x n sample places.
  [[nodiscard]] std::vector<float> samples() const;

 private:
  int n_;
  int reach_;                                ///< largest wave number of an axis
  std::vector<std::complex<double>> waves_;  ///< by j in [-reach, reach], then i in [0, reach]
};

/// The value at (u, v) by the rule of kernels.h, sums in double; NaN where void. `samples` tell the voids, where they
/// are not the coefficients.
[[nodiscard]] double evaluate(const Kernel& kernel, View2D<const float> coefficients, double u, double v);
[[nodiscard]] double evaluate(const Kernel& kernel, View2D<const float> coefficients, View2D<const float> samples,
                              double u, double v);

/// PSNR in dB of a mean squared error, squares / count, relative to the samples' peak-to-peak range.
[[nodiscard]] double psnr(const std::vector<float>& samples, double squares, std::int64_t count);

}  // namespace isohf
