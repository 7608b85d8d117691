#pragma once

#include <cstdint>
#include <vector>

/// Shadows of a sun that stands anywhere, swept over a grid of heights step by step (decisions 48 and 64).
///
///   lanes   0   1   2   3   4        A step is a row of heights, one in each lane. Lines of light pass through all
///   step 0  o\  o\  o\  o\  o\       steps, a lane's width apart, and drift by `shift` lanes at each. For an edge of
///   step 1  o \ o \ o \ o \ o \      the sun a line carries its caster: its height, and how many steps ago it was. From
///   step 2  o  \o  \o  \o  \o        them follow the height up to which it is dark, and the penumbra's width. On a step
///                                    the ground under a line is taken between the two lanes beside it; where it rises
///                                    above the dark it becomes the caster.
///                                    Nothing else mixes lines: a shadow stays as sharp after a thousand steps as it was.
///
/// What is hidden of the sun is found under each line, and interpolated on a lane between the two lines beside it.

namespace isohf {

/// One edge of the sun's disc: whatever is highest over its light casts the shadow. All in the unit of heights.
struct SunEdge {
  double fall = 1.0;      ///< of its shadow at a step, > 0
  double widening = 0.0;  ///< of the penumbra at a step, >= 0
  /// From its shadow's border to the height where half of the sun is hidden, in the penumbra's width and besides.
  double side = 0.0;
  double offset = 0.0;
  /// A penumbra counts as no narrower than least + widths * steep, up to `most`. least + widening > 0
  double least = 0.0;
  double steep = 0.0;
  double most = 0.0;
  /// Beyond it and the penumbra's width depths in the shadow are cut off, either way, so that a border between deep
  /// shadow and none lies midway.
  double deepest = 0.0;
};

/// The lines of light over one band of lanes.
class ShadowFront {
 public:
  /// lanes  at least 1
  /// shift  lanes that the light drifts by at a step, 0 to 1. At 0 and 1 the lines pass through the lanes
  /// edges  of the sun, at least one; what hides more counts
  /// range  what is hidden lies between 1/2 - range and 1/2 + range; > 1/2
  ShadowFront(int lanes, double shift, const std::vector<SunEdge>& edges, double range);

  /// Lanes whose ground casts shadows, at the step to come: first to last, fractional; none where last < first.
  struct Casting {
    double first;
    double last;
  };

  /// Moves on by one step. profile [-1...lanes]: heights, NaN where void; the two beyond the lanes are NaN, or ground.
  /// hidden [lanes] out: 0 or less all of the sun is seen, 1 or more none of it; null: not wanted.
  void advance(const float* profile, const Casting& casting, float* hidden);

  /// Whether the step to come moves each line on to the next lane.
  [[nodiscard]] bool is_shifting() const;
  /// Numbers that a line carries.
  [[nodiscard]] std::size_t carried() const { return 2 * edges_.size(); }
  /// Appends what the line carries that lies `lane` to lane + 1 after that step, before it falls.
  void append_arriving(int lane, std::vector<float>& to) const;
  /// Gives the line that arrives between lane 0 and 1 what it carries: what comes from the band before; null: nothing.
  void let_in(const float* carried);

  /// What all lines carry, [edges][casters' heights, steps since][lanes + 1], and going on from that with that step.
  [[nodiscard]] const std::vector<float>& lines() const { return lines_; }
  void resume(std::int64_t step, const std::vector<float>& lines);

 private:
  double shift_;
  std::vector<SunEdge> edges_;
  float range_;
  std::int64_t steps_ = 0;
  std::size_t count_;          ///< lanes + 1; line l lies between lanes l - 1 and l
  std::vector<float> lines_;   ///< [edges][heights, steps][count]
  std::vector<float> hidden_;  ///< [count] under the lines
};

}  // namespace isohf
