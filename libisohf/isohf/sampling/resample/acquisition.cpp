#include "isohf/sampling/resample/acquisition.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <string_view>

#include "isohf/base/handed_in.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kLargestSigma = 100.0;
constexpr std::size_t kMostTaps = 255;
/// A normal density holds less than 3e-19 beyond so many standard deviations.
constexpr double kGaussianReach = 9.0;

[[noreturn]] void refuse(const std::string& message) {
  throw Error(ErrorCode::kInvalidArgument, message);
}

std::optional<double> number_from(std::string_view text) {
  double value = 0.0;
  const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (status != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

constexpr int kGaussNodes = 16;

/// Nodes and weights on [-1, 1], by Newton's method on the Legendre polynomial of degree 16.
struct GaussLegendre {
  std::array<double, kGaussNodes> node;
  std::array<double, kGaussNodes> weight;

  GaussLegendre() : node{}, weight{} {
    for (int i = 0; i < kGaussNodes; ++i) {
      double x = std::cos(std::numbers::pi * (i + 0.75) / (kGaussNodes + 0.5));
      double slope = 1.0;
      for (int step = 0; step < 8; ++step) {  // converges in 4
        double previous = 1.0;
        double current = x;
        for (int n = 2; n <= kGaussNodes; ++n) {
          const double next = ((2 * n - 1) * x * current - (n - 1) * previous) / n;
          previous = current;
          current = next;
        }
        slope = kGaussNodes * (x * current - previous) / (x * x - 1.0);
        x -= current / slope;
      }
      node[static_cast<std::size_t>(i)] = x;
      weight[static_cast<std::size_t>(i)] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
  }
};

/// Integral of f from begin to end, cut at all halves of integers (the kernels' knots) and so that no piece is longer
/// than `longest`; 0 where end <= begin.
double integral(double begin, double end, double longest, const std::function<double(double)>& f) {
  static const GaussLegendre rule;
  double sum = 0.0;
  for (double half = std::floor(2.0 * begin); half < 2.0 * end; half += 1.0) {
    const double from = std::max(begin, 0.5 * half);
    const double to = std::min(end, 0.5 * (half + 1.0));
    if (to <= from) continue;
    const int pieces = static_cast<int>(std::ceil((to - from) / longest));
    const double radius = 0.5 * (to - from) / pieces;
    for (int piece = 0; piece < pieces; ++piece) {
      const double middle = from + (2 * piece + 1) * radius;
      for (std::size_t i = 0; i < kGaussNodes; ++i) sum += radius * rule.weight[i] * f(middle + radius * rule.node[i]);
    }
  }
  return sum;
}

double response_at(const Kernel& kernel, const Acquisition& acquisition, int k) {
  switch (acquisition.kind) {
    case Acquisition::Kind::kPoint:
      return kernel.value(k);
    case Acquisition::Kind::kBox:
      return integral(-0.5, 0.5, 0.5, [&](double x) { return kernel.value(k - x); });
    case Acquisition::Kind::kGaussian: {
      const double sigma = acquisition.sigma;
      const double reach = kGaussianReach * sigma;
      const double scale = 1.0 / (sigma * std::sqrt(2.0 * std::numbers::pi));
      return integral(
          std::max(-reach, k - kernel.support()), std::min(reach, k + kernel.support()), sigma,
          [&](double x) { return scale * std::exp(-0.5 * (x / sigma) * (x / sigma)) * kernel.value(k - x); });
    }
    case Acquisition::Kind::kTaps: {
      const int middle = static_cast<int>(acquisition.taps.size() / 2);
      double sum = 0.0;
      for (int j = -middle; j <= middle; ++j) {
        sum += acquisition.taps[static_cast<std::size_t>(j + middle)] * kernel.value(k - j);
      }
      return sum;
    }
  }
  return 0.0;
}

void require_sigma(double sigma, const std::string& text) {
  if (sigma > 0.0 && sigma <= kLargestSigma) return;
  refuse(fmt::format("acquisition is \"{}\": sigma must be a number above 0 and at most {} source samples", text,
                     kLargestSigma));
}

/// Checks that taps are a filter, and makes their sum 1.
void normalise(std::vector<double>& taps) {
  const std::size_t count = taps.size();
  const auto refuse_taps = [](const std::string& why) {
    refuse("acquisition by taps: " + why +
           ". Give an odd number of taps, the same from both ends, whose sum is not 0, as in 0.25,0.5,0.25");
  };
  if (count > kMostTaps) refuse_taps(fmt::format("there are more than {}", kMostTaps));
  if (count % 2 == 0) refuse_taps(fmt::format("there are {}", count));
  double sum = 0.0;
  double size = 0.0;
  for (const double tap : taps) {
    sum += tap;
    size += std::abs(tap);
  }
  // Decimal fractions of a sum leave 1e-16 or so of each tap.
  if (std::abs(sum) <= 1e-12 * size || !std::isfinite(size)) {
    refuse_taps(fmt::format("they sum to {}", sum));
  }
  for (std::size_t i = 0; i < count / 2; ++i) {
    const double left = taps[i];
    const double right = taps[count - 1 - i];
    if (std::abs(left - right) > 1e-9 * size) {
      refuse_taps(fmt::format("taps {} and {} are {} and {}", i + 1, count - i, left, right));
    }
    taps[i] = taps[count - 1 - i] = 0.5 * (left + right);
  }
  for (double& tap : taps) tap /= sum;
}

double reach_of(const Acquisition& acquisition) {
  switch (acquisition.kind) {
    case Acquisition::Kind::kPoint:
      return 0.0;
    case Acquisition::Kind::kBox:
      return 0.5;
    case Acquisition::Kind::kGaussian:
      return kGaussianReach * acquisition.sigma;
    case Acquisition::Kind::kTaps:
      return (static_cast<double>(acquisition.taps.size()) - 1.0) / 2.0;  // their number is odd
  }
  return 0.0;
}

}  // namespace

Acquisition acquisition_from_string(const std::string& text) {
  Acquisition result;
  if (text == "point") return result;
  if (text == "box") {
    result.kind = Acquisition::Kind::kBox;
    return result;
  }
  const std::string_view view = text;
  if (view.starts_with("gaussian:")) {
    const std::optional<double> sigma = number_from(view.substr(9));
    require_sigma(sigma.value_or(0.0), text);
    result.kind = Acquisition::Kind::kGaussian;
    result.sigma = *sigma;
    return result;
  }
  result.kind = Acquisition::Kind::kTaps;
  for (std::size_t at = 0; at <= view.size();) {
    const std::size_t end = std::min(view.find(',', at), view.size());
    const std::optional<double> tap = number_from(view.substr(at, end - at));
    if (!tap) {
      refuse(fmt::format("acquisition is \"{}\", must be point, box, gaussian:SIGMA or taps as 0.25,0.5,0.25", text));
    }
    result.taps.push_back(*tap);
    at = end + 1;
  }
  (void)with_taps(result);
  return result;
}

std::string to_string(const Acquisition& acquisition) {
  switch (acquisition.kind) {
    case Acquisition::Kind::kPoint:
      return "point";
    case Acquisition::Kind::kBox:
      return "box";
    case Acquisition::Kind::kGaussian:
      return fmt::format("gaussian:{}", acquisition.sigma);
    case Acquisition::Kind::kTaps:
      return fmt::format("{}", fmt::join(acquisition.taps, ","));
  }
  return {};
}

Acquisition with_taps(const Acquisition& acquisition) {
  require_known("`acquisition`", acquisition.kind, Acquisition::Kind::kTaps);
  Acquisition used = acquisition;
  if (used.kind == Acquisition::Kind::kGaussian) require_sigma(used.sigma, to_string(used));
  if (used.kind == Acquisition::Kind::kTaps) normalise(used.taps);
  return used;
}

std::vector<double> sampled_response(const Kernel& kernel, const Acquisition& acquisition) {
  const int last = static_cast<int>(std::ceil(kernel.support() + reach_of(acquisition)));
  std::vector<double> response;
  for (int k = 0; k <= last; ++k) response.push_back(response_at(kernel, acquisition, k));
  while (response.size() > 1 && std::abs(response.back()) < 1e-17) response.pop_back();
  return response;
}

}  // namespace isohf
