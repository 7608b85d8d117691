#pragma once

#include <cstdint>
#include <vector>

/// Shadows of a sun that stands anywhere, swept over a grid of heights step by step (decision 48).
///
///   lanes   0   1   2   3   4        A step is a row of heights, one in each lane. Lines of light pass through all
///   step 0  o\  o\  o\  o\  o\       steps, a lane's width apart, and drift by `shift` lanes at each. A line carries
///   step 1  o \ o \ o \ o \ o \      one number, the height up to which it is dark. On a step the ground under a line
///   step 2  o  \o  \o  \o  \o        is taken between the two lanes beside it; where it rises above the line's number
///                                    it becomes that. Nothing else mixes lines: a shadow stays as sharp after a
///                                    thousand steps as it was.
///
/// How deep a lane lies in the shadow is interpolated between the two lines beside it.

namespace isohf {

/// The lines of light over one band of lanes.
class ShadowFront {
 public:
  /// lanes       at least 1
  /// shift       lanes that the light drifts by at a step, 0 to 1. At 0 and 1 the lines pass through the lanes
  /// fall        of the shadow at a step, > 0
  /// most_depth  depths are cut off at it, either way, so that the border between deep shadow and none lies midway
  ShadowFront(int lanes, double shift, double fall, double most_depth);

  /// Lanes whose ground casts shadows, at the step to come: first to last, fractional; none where last < first.
  struct Casting {
    double first;
    double last;
  };

  /// Moves on by one step. profile [-1...lanes]: heights, NaN where void; the two beyond the lanes are NaN, or ground.
  /// depths [lanes] out: of the ground below the shadow's height, negative in the sun; null: not wanted.
  void advance(const float* profile, const Casting& casting, float* depths);

  /// Whether the step to come moves each line on to the next lane.
  [[nodiscard]] bool is_shifting() const;
  /// The height of the line that lies `lane` to lane + 1 after that step, before it falls.
  [[nodiscard]] float line_arriving(int lane) const { return lines_[static_cast<std::size_t>(lane)]; }
  /// Gives the line that arrives between lane 0 and 1 its height: what comes from the band before.
  void let_in(float height) { lines_[0] = height; }

  /// The heights of all lines, and going on from them with that step.
  [[nodiscard]] const std::vector<float>& lines() const { return lines_; }
  void resume(std::int64_t step, const std::vector<float>& lines);

 private:
  double shift_;
  float fall_;
  float most_depth_;
  std::int64_t steps_ = 0;
  std::vector<float> lines_;   ///< [lanes + 1] line l lies between lanes l - 1 and l
  std::vector<float> depths_;  ///< [lanes + 1] under the lines
};

}  // namespace isohf
