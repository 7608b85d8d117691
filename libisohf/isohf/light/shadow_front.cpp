#include "isohf/light/shadow_front.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/base/simd.h"

namespace isohf {
namespace {

constexpr float kNoCaster = -std::numeric_limits<float>::infinity();
/// Depth where nothing casts, so low that it is below any ground, and finite for sums.
constexpr float kNoDepth = -1e30F;
/// Lanes this near to the end of those that cast shadows count as on it: ends are found by quotients.
constexpr double kOnEnd = 1e-6;
/// Shifts of a line before its row is copied back.
constexpr std::size_t kRoom = 64;

/// SunEdge in floats.
struct Edge {
  float fall, widening, side, offset, least, steep, most, deepest, highest, low, high;
};

Edge in_floats(const SunEdge& edge, float range) {
  const auto in_float = [](double value) { return static_cast<float>(value); };
  return {in_float(edge.fall),
          in_float(edge.widening),
          in_float(edge.side),
          in_float(edge.offset),
          in_float(edge.least),
          in_float(edge.steep),
          in_float(edge.most),
          in_float(edge.deepest),
          in_float(edge.highest),
          0.5F - range,
          0.5F + range};
}

/// Where a line crosses the slanting side between the vertices of two steps, of the two kinds of lines: those whose
/// west lane has a vertex on the step before (0), and the others.
struct Crossing {
  float share[2];     ///< of the way to this step, from the vertex of the step before
  float ago[2];       ///< steps
  float per_lane[2];  ///< change of `share` at the next lane
  int other_end;      ///< lane of the side's end on this step, from the line's west lane: of kind 0; for kind 1 it is 0
  int first;          ///< kind of the first line
};

/// Lines meet the ground of a step alone. `none` is -infinity if it casts no shadows, else 0. Doubles give a line the
/// same caster however far it lies: shadow seeds count on it.
ISOHF_KERNEL void meet_ground(const float* west, const float* east, int count, float share, float none, double fall,
                              float* __restrict height, float* __restrict steps, float* __restrict rise) {
  for (int i = 0; i < count; ++i) {
    const float across = east[i] - west[i];
    const float ground = west[i] + share * across + none;
    const float ran = steps[i] + 1.0F;
    const double dark = static_cast<double>(height[i]) - static_cast<double>(ran) * fall;
    const bool casts = static_cast<double>(ground) > dark;
    height[i] = casts ? ground : height[i];
    steps[i] = casts ? 0.0F : ran;
    rise[i] = casts ? across : rise[i];
  }
}

/// Lines meet a side between two steps, then the ground of a step.
/// before, here  the west lane of the first line, on the step before and on this one; share: from there to the east
ISOHF_KERNEL void meet_sides(const float* before, const float* here, int count, float share, Crossing crossing,
                             float fall, float* __restrict height, float* __restrict steps, float* __restrict rise) {
  const float* const slant = here + crossing.other_end;
  for (int i = 0; i < count; ++i) {
    const bool odd = ((i + crossing.first) & 1) != 0;
    const float from = odd ? before[i + 1] : before[i];
    const float to = odd ? here[i] : slant[i];
    const float along = to - from;
    const float side = from + (odd ? crossing.share[1] : crossing.share[0]) * along;
    const float ago = odd ? crossing.ago[1] : crossing.ago[0];
    const float side_rise = (along + fall) * (odd ? crossing.per_lane[1] : crossing.per_lane[0]);
    const float across = here[i + 1] - here[i];
    const float ground = here[i] + share * across;
    const float ran = steps[i] + 1.0F;
    const float dark = height[i] - ran * fall;
    const float side_dark = side - ago * fall;
    const bool by_side = side_dark > dark;
    const float darker = by_side ? side_dark : dark;
    const bool by_ground = ground > darker;
    const float held = by_side ? side : height[i];
    const float since = by_side ? ago : ran;
    const float rising = by_side ? side_rise : rise[i];
    height[i] = by_ground ? ground : held;
    steps[i] = by_ground ? 0.0F : since;
    rise[i] = by_ground ? across : rising;
  }
}

/// Lines that pass over a lane meet the side along it, `ago` steps before this one.
ISOHF_KERNEL void meet_lane(const float* before, const float* here, int count, float ago, float per_lane, float fall,
                            float* __restrict height, float* __restrict steps, float* __restrict rise) {
  const float fallen = ago * fall;
  for (int i = 0; i < count; ++i) {
    const float along = here[i] - before[i];
    const float side = here[i] - ago * along;
    const float dark = height[i] - steps[i] * fall;
    const bool casts = side - fallen > dark;
    height[i] = casts ? side : height[i];
    steps[i] = casts ? ago : steps[i];
    rise[i] = casts ? (along + fall) * per_lane : rise[i];
  }
}

/// Ground that the light of lanes has crossed on the step before.
struct Near {
  const float* lanes;
  float share;  ///< of the way to the lane before
  float none;   ///< -infinity if it casts no shadows, else 0
};

/// What lines carry of an edge.
struct Carried {
  const float* height;
  const float* steps;
  const float* rise;
};

/// The width that a penumbra counts as having.
ISOHF_KERNEL float wide_of(float width, const Edge& edge) {
  float wide = edge.least + width * edge.steep;
  wide = wide < edge.most ? wide : edge.most;
  return width > wide ? width : wide;
}

/// The part of the sun that an edge hides at that depth below the height where half of the sun is hidden. NaN, if there
/// is no ground, counts as lit.
ISOHF_KERNEL float part_of(float depth, float wide, const Edge& edge) {
  const float deepest = wide > edge.deepest ? wide : edge.deepest;
  const float highest = wide > edge.highest ? wide : edge.highest;
  depth = depth > -highest ? depth : -highest;
  depth = depth < deepest ? depth : deepest;
  float part = depth / wide + 0.5F;
  part = part > edge.low ? part : edge.low;
  return part < edge.high ? part : edge.high;
}

/// Numbers that a vector holds: loops over as many, or a multiple, have no rest.
constexpr int kVector = 8;
int whole_vectors(int count) {
  return count < kVector ? count : (count + kVector - 1) / kVector * kVector;
}

/// The part of the sun that is hidden from every second lane, if lines pass through the lanes.
ISOHF_KERNEL void shade_under_lines(const float* lanes, int count, Carried lines, double fall, Edge edge,
                                    float* __restrict hidden) {
  for (int i = 0; i < count; ++i) {
    const float ran = lines.steps[2 * i] + 1.0F;
    const double dark = static_cast<double>(lines.height[2 * i]) - static_cast<double>(ran) * fall;
    const float width = ran * edge.widening;
    const float depth = static_cast<float>(dark - static_cast<double>(lanes[2 * i])) + edge.side * width + edge.offset;
    const float part = part_of(depth, wide_of(width, edge), edge);
    hidden[i] = part > hidden[i] ? part : hidden[i];
  }
}

/// The same, if each lane lies between two lines. to_west is the share of the way from the east line to the west one.
ISOHF_KERNEL void shade_between_lines(const float* lanes, Near near, int count, Carried lines, float to_west, Edge edge,
                                      float* __restrict hidden) {
  const float to_east = 1.0F - to_west;
  const float near_wide = wide_of(edge.widening, edge);
  const float near_fall = edge.side * edge.widening + edge.offset - edge.fall + near.none;
  for (int i = 0; i < count; ++i) {
    const float ground = lanes[2 * i];
    const float west_ran = lines.steps[2 * i] + 1.0F;
    const float east_ran = lines.steps[2 * i + 1] + 1.0F;
    const float west_rise = lines.rise[2 * i];
    const float east_rise = lines.rise[2 * i + 1];
    float west = (lines.height[2 * i] - ground) - west_ran * edge.fall;
    float east = (lines.height[2 * i + 1] - ground) - east_ran * edge.fall;
    // The width of the penumbra is that of the darker line's caster.
    const float width = (west > east ? west_ran : east_ran) * edge.widening;
    float wide = wide_of(width, edge);
    const float limit = wide > edge.deepest ? wide : edge.deepest;
    const float to_half = edge.side * width + edge.offset;
    west += to_half;
    east += to_half;
    west = west > kNoDepth ? west : kNoDepth;
    east = east > kNoDepth ? east : kNoDepth;
    // Each line's shadow continued to the lane, and to the other line. If it is above the other's both ways, the
    // casters are the sides of a peak, and the lower one is right; if below both ways, those of a valley.
    const float from_west = west + west_rise * to_east;
    const float from_east = east - east_rise * to_west;
    const float over_east = west + west_rise - east;
    const float over_west = east - east_rise - west;
    const float lower = from_west < from_east ? from_west : from_east;
    const float upper = from_west < from_east ? from_east : from_west;
    west = west > -limit ? west : -limit;
    west = west < limit ? west : limit;
    east = east > -limit ? east : -limit;
    east = east < limit ? east : limit;
    float depth = east + to_west * (west - east);
    const float least_over = over_east < over_west ? over_east : over_west;
    const float most_over = over_east < over_west ? over_west : over_east;
    depth = least_over >= 0.0F ? lower : depth;
    depth = most_over <= 0.0F ? upper : depth;
    const float crossed = near.lanes[2 * i] + near.share * (near.lanes[2 * i - 1] - near.lanes[2 * i]);
    const float own = crossed - ground + near_fall;
    wide = own > depth ? near_wide : wide;
    depth = own > depth ? own : depth;
    const float part = part_of(depth, wide, edge);
    hidden[i] = part > hidden[i] ? part : hidden[i];
  }
}

}  // namespace

ShadowFront::ShadowFront(int lanes, Lanes kind, double shift, const std::vector<SunEdge>& edges, double range)
    : kind_(kind),
      shift_(shift),
      edges_(edges),
      range_(static_cast<float>(range)),
      count_(static_cast<std::size_t>(lanes) + 1),
      stride_(count_ + kRoom + kOverrun),
      origin_(kRoom) {
  resume(0, {});
}

void ShadowFront::resume(std::int64_t step, const std::vector<float>& lines) {
  steps_ = step;
  origin_ = kRoom;
  lines_.assign(stride_ * carried(), 0.0F);
  for (std::size_t k = 0; k < carried(); ++k) {
    if (!lines.empty()) {
      std::copy_n(lines.data() + k * count_, count_, line(k));
    } else if (k % 3 == 0) {
      std::fill_n(line(k), count_, kNoCaster);
    }
  }
}

std::vector<float> ShadowFront::lines() const {
  std::vector<float> all;
  all.reserve(count_ * carried());
  for (std::size_t k = 0; k < carried(); ++k) all.insert(all.end(), line(k), line(k) + count_);
  return all;
}

void ShadowFront::append_arriving(int lane, std::vector<float>& to) const {
  for (std::size_t k = 0; k < carried(); ++k) to.push_back(line(k)[lane]);
}

void ShadowFront::let_in(const float* carried) {
  for (std::size_t k = 0; k < this->carried(); ++k) {
    const float nothing = k % 3 == 0 ? kNoCaster : 0.0F;
    line(k)[0] = carried != nullptr ? carried[k] : nothing;
  }
}

bool ShadowFront::is_shifting() const {
  const auto step = static_cast<double>(steps_);
  return steps_ > 0 && std::floor(step * shift_) > std::floor((step - 1.0) * shift_);
}

void ShadowFront::shift_lines() {
  if (origin_ == 0) {
    for (std::size_t k = 0; k < carried(); ++k) {
      float* const row = lines_.data() + k * stride_;
      std::copy_backward(row, row + count_, row + kRoom + count_);
    }
    origin_ = kRoom;
  }
  --origin_;
  let_in(nullptr);
}

void ShadowFront::shade(const Step& before, const Step& here, double share, float* hidden) {
  const int lanes = static_cast<int>(count_) - 1;
  const bool has_before = before.heights != nullptr && before.first_casting <= before.last_casting;
  const auto lane = [lanes](double value) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(lanes)));
  };
  const int last = has_before ? lane(std::floor(before.last_casting + shift_ + kOnEnd) + 1.0) : 0;
  const int first = has_before ? std::min(last, lane(std::ceil(before.first_casting + shift_ - kOnEnd))) : 0;
  const float* const near = before.heights != nullptr ? before.heights : here.heights;
  const auto shade_every_second = [&](int begin, int end, float none, float* out) {
    if (begin >= end) return;
    const int count = whole_vectors((end - begin + 1) / 2);
    std::fill_n(out, count, 0.5F - range_);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      const Edge edge = in_floats(edges_[e], range_);
      // Lane i lies between lines i and i + 1, and on the second one if the share is 0.
      const int to_line = begin + (share > 0.0 ? 0 : 1);
      const Carried lines{line(3 * e) + to_line, line(3 * e + 1) + to_line, line(3 * e + 2) + to_line};
      if (share > 0.0) {
        vectorised<shade_between_lines>(here.heights + begin, Near{near + begin, static_cast<float>(shift_), none},
                                        count, lines, static_cast<float>(share), edge, out);
      } else {
        vectorised<shade_under_lines>(here.heights + begin, count, lines, edges_[e].fall, edge, out);
      }
    }
  };
  const auto shade_from = [&](int begin, float* out) {
    const auto part = [&](int from, int to, float none) {
      const int lane_at = from + ((from ^ begin) & 1);
      shade_every_second(lane_at, to, none, out + (lane_at - begin) / 2);
    };
    part(begin, first, kNoCaster);
    part(std::max(begin, first), last, 0.0F);
    part(std::max(begin, last), lanes, kNoCaster);
  };
  float* const more = hidden + first_of_more(lanes);
  shade_from(here.vertex_lane, hidden);
  if (here.more_vertices == 1) shade_from(1 - here.vertex_lane, more);
  for (int k = 0; here.more_vertices > 1 && k * here.more_vertices < lanes; ++k) {
    const int at = k * here.more_vertices;
    shade_every_second(at, at + 1, at >= first && at < last ? 0.0F : kNoCaster, more + k);
  }
}

void ShadowFront::meet(const Step& before, const Step& here, double share, bool is_over_lane) {
  const auto part = static_cast<float>(share);
  const auto count = static_cast<int>(count_);
  // Line l lies at lane l - 1 + share.
  const auto line_at = [count](double value) {
    return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(count)));
  };
  const int last = line_at(std::floor(here.last_casting + 2.0 - share + kOnEnd));
  const int first = std::min(last, line_at(std::ceil(here.first_casting + 1.0 - share - kOnEnd)));
  const bool has_sides =
      shift_ > 0.0 && shift_ < 1.0 && before.heights != nullptr && before.first_casting <= before.last_casting;
  // A line that has arrived from beyond the lanes has no ground on the step before.
  const int sides = has_sides ? std::min(last, std::max(first, is_over_lane ? 1 : 0)) : last;
  Crossing crossing{};
  const double drift = 1.0 + shift_;
  // Of a line on the step before, from the lane to its West.
  const double from_lane = share - shift_ + (is_over_lane ? 1.0 : 0.0);
  const auto set = [&](std::size_t kind, double way, double per_lane) {
    const double clamped = std::clamp(way, 0.0, 1.0);
    crossing.share[kind] = static_cast<float>(clamped);
    crossing.ago[kind] = static_cast<float>(1.0 - clamped);
    crossing.per_lane[kind] = static_cast<float>(per_lane);
  };
  if (has_sides && is_over_lane) {
    set(0, (1.0 - from_lane) / drift, -1.0 / drift);
    set(1, (2.0 - from_lane) / drift, -1.0 / drift);
    crossing.other_end = -1;
  } else if (has_sides) {
    set(0, from_lane / (1.0 - shift_), 1.0 / (1.0 - shift_));
    set(1, (1.0 - from_lane) / drift, -1.0 / drift);
    crossing.other_end = 1;
  }
  crossing.first = (sides - 1 - before.vertex_lane) & 1;
  for (std::size_t e = 0; e < edges_.size(); ++e) {
    const auto fall = static_cast<float>(edges_[e].fall);
    float* const height = line(3 * e);
    float* const steps = line(3 * e + 1);
    float* const rise = line(3 * e + 2);
    const auto meet_alone = [&](int begin, int end, float none) {
      if (begin >= end) return;
      const float* const west = here.heights + begin - 1;
      vectorised<meet_ground>(west, part > 0.0F ? west + 1 : west, end - begin, part, none, edges_[e].fall,
                              height + begin, steps + begin, rise + begin);
    };
    meet_alone(0, first, kNoCaster);
    meet_alone(first, sides, 0.0F);
    meet_alone(last, count, kNoCaster);
    if (sides >= last) continue;
    const float* const west_before = before.heights + sides - 1;
    const float* const west = here.heights + sides - 1;
    const int met = last == count ? whole_vectors(last - sides) : last - sides;
    vectorised<meet_sides>(west_before, west, met, part, crossing, fall, height + sides, steps + sides, rise + sides);
    if (!is_over_lane || kind_ != Lanes::kAreSides) continue;
    const double ago = 1.0 - (1.0 - from_lane) / shift_;
    vectorised<meet_lane>(west_before, west, met, static_cast<float>(ago), static_cast<float>(-1.0 / shift_), fall,
                          height + sides, steps + sides, rise + sides);
  }
}

void ShadowFront::advance(const Step& before, const Step& here, float* hidden) {
  const bool is_over_lane = is_shifting();
  if (is_over_lane) shift_lines();
  const double place = static_cast<double>(steps_++) * shift_;
  const double share = place - std::floor(place);
  if (hidden != nullptr) shade(before, here, share, hidden);
  meet(before, here, share, is_over_lane);
}

}  // namespace isohf
