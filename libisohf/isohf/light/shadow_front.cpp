#include "isohf/light/shadow_front.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr float kNoCaster = -std::numeric_limits<float>::infinity();
/// Lanes this near to the end of those that cast shadows count as on it: ends are found by quotients.
constexpr double kOnEnd = 1e-6;

/// SunEdge in floats. What falls in many steps does in doubles: a line's caster is then the same one, however far it
/// lies.
struct Edge {
  double fall;
  float widening, side, offset, least, steep, most, deepest, low, high;
};

/// Lines between the ground at west[i] and east[i], `share` of the way. Voids cast nothing; a line beside one lies over
/// the ground on its other side.
ISOHF_KERNEL void move_lines(const float* west, const float* east, int count, float share, Edge edge, float none,
                             float* __restrict heights, float* __restrict steps, float* __restrict hidden) {
  for (int i = 0; i < count; ++i) {
    const float a = west[i];
    const float b = east[i];
    const float between = a + share * (b - a);
    const bool whole = between == between;
    const float beside = a == a ? a : b;
    const float ground = whole ? between : beside;
    const float ran = steps[i] + 1.0F;
    const double dark = static_cast<double>(heights[i]) - static_cast<double>(ran) * edge.fall;
    const float width = ran * edge.widening;
    // `none` is -infinity where ground casts no shadows, else 0.
    const float caster = whole ? between + none : kNoCaster;
    const bool casts = static_cast<double>(caster) > dark;
    heights[i] = casts ? caster : heights[i];
    steps[i] = casts ? 0.0F : ran;
    float wide = edge.least + width * edge.steep;
    wide = wide < edge.most ? wide : edge.most;
    wide = width > wide ? width : wide;
    const float limit = wide > edge.deepest ? wide : edge.deepest;
    float depth = static_cast<float>(dark - static_cast<double>(ground)) + edge.side * width + edge.offset;
    // NaN, where there is no ground, counts as lit.
    depth = depth > -limit ? depth : -limit;
    depth = depth < limit ? depth : limit;
    float part = depth / wide + 0.5F;
    part = part > edge.low ? part : edge.low;
    part = part < edge.high ? part : edge.high;
    hidden[i] = part > hidden[i] ? part : hidden[i];
  }
}

ISOHF_KERNEL void mix_lines(const float* lines, int count, float share, float* __restrict hidden) {
  for (int i = 0; i < count; ++i) hidden[i] = lines[i + 1] + share * (lines[i] - lines[i + 1]);
}

}  // namespace

ShadowFront::ShadowFront(int lanes, double shift, const std::vector<SunEdge>& edges, double range)
    : shift_(shift),
      edges_(edges),
      range_(static_cast<float>(range)),
      count_(static_cast<std::size_t>(lanes) + 1),
      lines_(count_ * carried()),
      hidden_(count_) {
  for (std::size_t k = 0; k < carried(); k += 2) std::fill_n(lines_.data() + k * count_, count_, kNoCaster);
}

void ShadowFront::resume(std::int64_t step, const std::vector<float>& lines) {
  lines_ = lines;
  steps_ = step;
}

void ShadowFront::append_arriving(int lane, std::vector<float>& to) const {
  for (std::size_t k = 0; k < carried(); ++k) to.push_back(lines_[k * count_ + static_cast<std::size_t>(lane)]);
}

void ShadowFront::let_in(const float* carried) {
  for (std::size_t k = 0; k < this->carried(); ++k) {
    const float nothing = k % 2 == 0 ? kNoCaster : 0.0F;
    lines_[k * count_] = carried != nullptr ? carried[k] : nothing;
  }
}

bool ShadowFront::is_shifting() const {
  const auto step = static_cast<double>(steps_);
  return steps_ > 0 && std::floor(step * shift_) > std::floor((step - 1.0) * shift_);
}

void ShadowFront::advance(const float* profile, const Casting& casting, float* hidden) {
  if (is_shifting()) {
    for (std::size_t k = 0; k < carried(); ++k) {
      float* const line = lines_.data() + k * count_;
      std::copy_backward(line, line + count_ - 1, line + count_);
    }
    let_in(nullptr);
  }
  const double place = static_cast<double>(steps_++) * shift_;
  const double share = place - std::floor(place);
  // Line l lies at lane l - 1 + share.
  const auto count = static_cast<double>(count_);
  const auto first = static_cast<int>(std::clamp(std::ceil(casting.first + 1.0 - share - kOnEnd), 0.0, count));
  const auto last = static_cast<int>(std::clamp(std::floor(casting.last + 2.0 - share + kOnEnd), 0.0, count));
  const auto part = static_cast<float>(share);
  std::fill(hidden_.begin(), hidden_.end(), 0.5F - range_);
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const SunEdge& of = edges_[e];
    const auto in_float = [](double value) { return static_cast<float>(value); };
    const Edge edge{of.fall,
                    in_float(of.widening),
                    in_float(of.side),
                    in_float(of.offset),
                    in_float(of.least),
                    in_float(of.steep),
                    in_float(of.most),
                    in_float(of.deepest),
                    0.5F - range_,
                    0.5F + range_};
    const auto move = [&](int begin, int end, float none) {
      if (begin >= end) return;
      const float* const west = profile + begin - 1;
      float* const heights = lines_.data() + 2 * e * count_ + begin;
      vectorised<move_lines>(west, part > 0.0F ? west + 1 : west, end - begin, part, edge, none, heights,
                             heights + count_, hidden_.data() + begin);
    };
    move(0, std::min(first, last), kNoCaster);
    move(std::min(first, last), last, 0.0F);
    move(last, static_cast<int>(count_), kNoCaster);
  }
  if (hidden != nullptr) {
    vectorised<mix_lines>(static_cast<const float*>(hidden_.data()), static_cast<int>(count_) - 1, part, hidden);
  }
}

}  // namespace isohf
