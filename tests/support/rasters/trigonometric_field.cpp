#include "support/rasters/trigonometric_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace isohf {

double psnr(const std::vector<float>& samples, double squares, std::int64_t count) {
  const auto [low, high] = std::minmax_element(samples.begin(), samples.end());
  return 20.0 * std::log10((*high - *low) / std::sqrt(squares / static_cast<double>(count)));
}

TrigonometricField::TrigonometricField(int n, double p, double rho, std::uint64_t seed)
    : n_(n), reach_(static_cast<int>(rho * n / 2)) {
  std::mt19937_64 random(seed);
  for (int j = -reach_; j <= reach_; ++j) {
    for (int i = 0; i <= reach_; ++i) {
      const double phase = 2.0 * std::numbers::pi * static_cast<double>(random() >> 11U) * 0x1p-53;
      const double length = std::hypot(i, j);
      // Each wave once: of those along the rows' axis, i = 0, only the half j > 0.
      const bool counts = length <= 0.5 * rho * n && (i > 0 || j > 0);
      waves_.push_back(counts ? std::polar(std::pow(length, -p), phase) : 0.0);
    }
  }
}

std::vector<double> TrigonometricField::row(double v, double first_u, double step_u, int count) const {
  const double unit = 2.0 * std::numbers::pi / n_;
  const auto width = static_cast<std::size_t>(reach_ + 1);
  std::vector<std::complex<double>> along(width);
  for (int j = -reach_; j <= reach_; ++j) {
    const std::complex<double> turn = std::polar(1.0, unit * j * v);
    for (std::size_t i = 0; i < width; ++i) along[i] += waves_[static_cast<std::size_t>(j + reach_) * width + i] * turn;
  }
  std::vector<double> heights;
  for (int c = 0; c < count; ++c) {
    double sum = 0.0;
    for (std::size_t i = 0; i < width; ++i) {
      const double angle = unit * static_cast<double>(i) * (first_u + c * step_u);
      sum += along[i].real() * std::cos(angle) - along[i].imag() * std::sin(angle);
    }
    heights.push_back(sum);
  }
  return heights;
}

std::vector<float> TrigonometricField::samples() const {
  std::vector<float> all;
  for (int r = 0; r < n_; ++r) {
    for (const double height : row(r, 0.0, 1.0, n_)) all.push_back(static_cast<float>(height));
  }
  return all;
}

namespace {

/// Missing taps of a line of four: each is the mirror image of one inside, at one of the middle two as a point.
template <typename Tap>
void go_on(Tap tap) {
  if (std::isnan(tap(1)) || std::isnan(tap(2))) return;
  if (std::isnan(tap(0))) tap(0) = 2.0 * tap(1) - tap(2);
  if (std::isnan(tap(3))) tap(3) = 2.0 * tap(2) - tap(1);
}

}  // namespace

double evaluate(const Kernel& kernel, View2D<const float> coefficients, double u, double v) {
  return evaluate(kernel, coefficients, coefficients, u, v);
}

double evaluate(const Kernel& kernel, View2D<const float> coefficients, View2D<const float> samples, double u,
                double v) {
  const auto coefficient = [&](std::int64_t c, std::int64_t r) {
    double height = 0.0;
    continue_row(r, coefficients.rows(), [&](std::int64_t row, int row_weight) {
      continue_row(c, coefficients.columns(), [&](std::int64_t column, int weight) {
        height += row_weight * weight * static_cast<double>(coefficients(column, row));
      });
    });
    return height;
  };
  const auto is_valid = [&](std::int64_t c, std::int64_t r) {
    return !std::isnan(samples(mirror_index(c, samples.columns()), mirror_index(r, samples.rows())));
  };
  const auto is_void = [&](double c, double r) {
    return !is_valid(static_cast<std::int64_t>(c), static_cast<std::int64_t>(r));
  };
  const double nothing = std::numeric_limits<double>::quiet_NaN();
  if (is_void(std::floor(u), std::floor(v)) && is_void(std::ceil(u), std::floor(v)) &&
      is_void(std::floor(u), std::ceil(v)) && is_void(std::ceil(u), std::ceil(v))) {
    return nothing;
  }
  const TapWeights across = kernel.at(u);
  const TapWeights down = kernel.at(v);
  const int taps = kernel.taps();
  std::vector<double> block(static_cast<std::size_t>(taps * taps));  // NaN where missing
  const auto tap = [&](int i, int j) -> double& { return block[static_cast<std::size_t>(j * taps + i)]; };
  const auto weight_of = [&](int i, int j) {
    return static_cast<double>(across.weights[static_cast<std::size_t>(i)]) *
           static_cast<double>(down.weights[static_cast<std::size_t>(j)]);
  };
  double valid = 0.0;
  bool has_void = false;
  for (int j = 0; j < taps; ++j) {
    for (int i = 0; i < taps; ++i) {
      tap(i, j) = coefficient(across.first + i, down.first + j);
      if (is_valid(across.first + i, down.first + j)) {
        valid += weight_of(i, j);
      } else {
        has_void = true;
      }
    }
  }
  if (valid < 0.5) return nothing;
  if (taps == 4) {
    for (int line = 0; line < 8; ++line) {  // rows, then columns
      go_on([&](int k) -> double& { return line < 4 ? tap(k, line) : tap(line - 4, k); });
    }
  }
  double weight = 0.0;
  double sum = 0.0;
  bool whole = true;
  for (int j = 0; j < taps; ++j) {
    for (int i = 0; i < taps; ++i) {
      whole = whole && !std::isnan(tap(i, j));
      if (std::isnan(tap(i, j))) continue;
      weight += weight_of(i, j);
      sum += weight_of(i, j) * tap(i, j);
    }
  }
  const double height = whole ? sum : sum / weight;
  double least = std::numeric_limits<double>::infinity();
  double most = -least;
  if (kernel.edges() == Edges::kHeld && has_void) {
    // Samples around the place are what the kernel has at whole positions, where they are no voids.
    for (const std::int64_t row : {down.first + taps / 2 - 1, down.first + taps / 2}) {
      for (const std::int64_t column : {across.first + taps / 2 - 1, across.first + taps / 2}) {
        if (!is_valid(column, row)) continue;
        double sample = 0.0;
        for (int j = 0; j < taps; ++j) {
          for (int i = 0; i < taps; ++i) {
            const double share = kernel.value(static_cast<double>(row - down.first - j)) *
                                 kernel.value(static_cast<double>(column - across.first - i));
            if (share != 0.0) sample += share * tap(i, j);
          }
        }
        least = std::min(least, sample);
        most = std::max(most, sample);
      }
    }
    return std::clamp(height, 1.25 * least - 0.25 * most, 1.25 * most - 0.25 * least);
  }
  if (!kernel.is_limited()) return height;
  for (const std::int64_t row : {down.first + 1, down.first + 2}) {
    for (const std::int64_t column : {across.first + 1, across.first + 2}) {
      const std::int64_t c = mirror_index(column, samples.columns());
      const std::int64_t r = mirror_index(row, samples.rows());
      if (std::isnan(samples(c, r))) continue;
      least = std::min(least, static_cast<double>(coefficients(c, r)));
      most = std::max(most, static_cast<double>(coefficients(c, r)));
    }
  }
  return std::clamp(height, least, most);
}

}  // namespace isohf
