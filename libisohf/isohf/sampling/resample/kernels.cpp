#include "isohf/sampling/resample/kernels.h"

#include <cmath>
#include <utility>

#include "isohf/base/handed_in.h"
#include "isohf/error.h"

namespace isohf {
namespace {

struct FilterEntry {
  Filter filter;
  const char* name;
  int taps;
};

constexpr std::array<FilterEntry, 4> kFilters = {{
    {Filter::kNearest, "nearest", 1},
    {Filter::kBilinear, "bilinear", 2},
    {Filter::kLimitedCubic, "limited-cubic", 4},
    {Filter::kBspline3, "bspline3", 4},
}};

using Weights = std::array<double, kMaxTaps>;

// All take t, how far the position lies past its base tap: floor(u) for even tap counts, t in [0, 1); the nearest
// sample for odd ones, t in [-1/2, 1/2).

/// A straight line and 4/3 of what Catmull-Rom adds to it: as much at the middle as the cubic spline of all samples
/// would, to 0.02, by four of them. Exact on planes; 4/3 by measurement (docs/decisions/0027).
void limited_cubic_weights(double t, Weights& w) {
  const double s = 1.0 - t;
  const double before = 2.0 / 3.0 * t * s * s;
  const double after = 2.0 / 3.0 * s * t * t;
  w[0] = -before;
  w[1] = s + 2.0 * before - after;
  w[2] = t + 2.0 * after - before;
  w[3] = -after;
}

void bspline3_weights(double t, Weights& w) {
  const double s = 1.0 - t;
  w[0] = s * s * s / 6.0;
  w[1] = 2.0 / 3.0 - 0.5 * t * t * (1.0 + s);
  w[2] = 2.0 / 3.0 - 0.5 * s * s * (1.0 + t);
  w[3] = t * t * t / 6.0;
}

/// Weights in double and the first tap.
std::int64_t weights_at(Filter filter, int taps, double u, Weights& w) {
  double base = std::floor(u);
  double t = u - base;
  if ((taps & 1) != 0 ? t >= 0.5 : t == 1.0) {  // 1 where u is so little below an integer that u - base rounds
    base += 1.0;
    t -= 1.0;
  }
  switch (filter) {
    case Filter::kNearest:
      w[0] = 1.0;
      break;
    case Filter::kBilinear:
      w[0] = 1.0 - t;
      w[1] = t;
      break;
    case Filter::kLimitedCubic:
      limited_cubic_weights(t, w);
      break;
    case Filter::kBspline3:
      bspline3_weights(t, w);
      break;
  }
  return static_cast<std::int64_t>(base) - (taps - 1) / 2;
}

}  // namespace

std::string to_string(Filter filter) {
  for (const FilterEntry& entry : kFilters) {
    if (entry.filter == filter) return entry.name;
  }
  return {};
}

Filter filter_from_string(const std::string& text) {
  std::string names;
  for (const FilterEntry& entry : kFilters) {
    if (text == entry.name) return entry.filter;
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw Error(ErrorCode::kInvalidArgument, "filter is \"" + text + "\", must be one of " + names);
}

std::string to_string(Edges edges) {
  return edges == Edges::kHeld ? "odd-held" : "odd";
}

Edges usual_edges(Filter filter) {
  return filter == Filter::kBspline3 ? Edges::kHeld : Edges::kOdd;
}

Edges edges_from_string(const std::string& text) {
  if (text == "odd-held") return Edges::kHeld;
  if (text == "odd") return Edges::kOdd;
  throw Error(ErrorCode::kInvalidArgument, "edges is \"" + text + "\", must be odd-held or odd");
}

Kernel Kernel::make(Filter filter, Edges edges) {
  require_known("filter", filter, Filter::kBspline3);
  int taps = 0;
  for (const FilterEntry& entry : kFilters) {
    if (entry.filter == filter) taps = entry.taps;
  }
  return {filter, taps, edges};
}

TapWeights Kernel::at(double u) const {
  Weights exact{};
  TapWeights result{};
  result.first = weights_at(filter_, taps_, u, exact);
  for (std::size_t i = 0; i < static_cast<std::size_t>(taps_); ++i) result.weights[i] = static_cast<float>(exact[i]);
  return result;
}

double Kernel::value(double x) const {
  Weights exact{};
  const std::int64_t first = weights_at(filter_, taps_, x, exact);  // the position x, seen from a sample at 0
  return first <= 0 && -first < taps_ ? exact[static_cast<std::size_t>(-first)] : 0.0;
}

std::int64_t mirror_index(std::int64_t k, std::int64_t count) {
  if (k >= 0 && k < count) return k;
  if (count == 1) return 0;
  const std::int64_t period = 2 * (count - 1);
  k %= period;
  if (k < 0) k += period;
  return k < count ? k : period - k;
}

}  // namespace isohf
