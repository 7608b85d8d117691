#include "isohf/surface/shade/shadow_front.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr float kNoCaster = -std::numeric_limits<float>::infinity();
/// Lanes this near to the end of those that cast shadows count as on it: ends are found by quotients.
constexpr double kOnEnd = 1e-6;

/// Lines between the ground at west[i] and east[i], `share` of the way. Voids cast nothing; a line beside one lies over
/// the ground on its other side.
ISOHF_KERNEL void move_lines(const float* west, const float* east, int count, float share, float fall, float most_depth,
                             float none, float* __restrict lines, float* __restrict depths) {
  for (int i = 0; i < count; ++i) {
    const float a = west[i];
    const float b = east[i];
    const float between = a + share * (b - a);
    const bool whole = between == between;
    const float beside = a == a ? a : b;
    const float ground = whole ? between : beside;
    const float dark = lines[i] - fall;
    // `none` is -infinity where ground casts no shadows, else 0.
    const float caster = whole ? between + none : kNoCaster;
    lines[i] = caster > dark ? caster : dark;
    float depth = dark - ground;
    depth = depth > -most_depth ? depth : -most_depth;
    depths[i] = depth < most_depth ? depth : most_depth;
  }
}

ISOHF_KERNEL void mix_depths(const float* lines, int count, float share, float* __restrict depths) {
  for (int i = 0; i < count; ++i) depths[i] = lines[i + 1] + share * (lines[i] - lines[i + 1]);
}

}  // namespace

ShadowFront::ShadowFront(int lanes, double shift, double fall, double most_depth)
    : shift_(shift),
      fall_(static_cast<float>(fall)),
      most_depth_(static_cast<float>(most_depth)),
      lines_(static_cast<std::size_t>(lanes) + 1, kNoCaster),
      depths_(lines_.size()) {}

void ShadowFront::resume(std::int64_t step, const std::vector<float>& lines) {
  lines_ = lines;
  steps_ = step;
}

bool ShadowFront::is_shifting() const {
  const auto step = static_cast<double>(steps_);
  return steps_ > 0 && std::floor(step * shift_) > std::floor((step - 1.0) * shift_);
}

void ShadowFront::advance(const float* profile, const Casting& casting, float* depths) {
  if (is_shifting()) {
    std::copy_backward(lines_.begin(), lines_.end() - 1, lines_.end());
    lines_.front() = kNoCaster;
  }
  const double place = static_cast<double>(steps_++) * shift_;
  const double share = place - std::floor(place);
  // Line l lies at lane l - 1 + share.
  const auto count = static_cast<double>(lines_.size());
  const auto first = static_cast<int>(std::clamp(std::ceil(casting.first + 1.0 - share - kOnEnd), 0.0, count));
  const auto last = static_cast<int>(std::clamp(std::floor(casting.last + 2.0 - share + kOnEnd), 0.0, count));
  const auto part = static_cast<float>(share);
  const auto move = [&](int begin, int end, float none) {
    if (begin >= end) return;
    const float* const west = profile + begin - 1;
    vectorised<move_lines>(west, part > 0.0F ? west + 1 : west, end - begin, part, fall_, most_depth_, none,
                           lines_.data() + begin, depths_.data() + begin);
  };
  move(0, std::min(first, last), kNoCaster);
  move(std::min(first, last), last, 0.0F);
  move(last, static_cast<int>(lines_.size()), kNoCaster);
  if (depths != nullptr) {
    vectorised<mix_depths>(static_cast<const float*>(depths_.data()), static_cast<int>(lines_.size()) - 1, part,
                           depths);
  }
}

}  // namespace isohf
