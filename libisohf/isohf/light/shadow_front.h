#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

/// Shadows of a sun that stands anywhere, swept over a grid of heights step by step (decisions 48, 64 and 79).
///
///   lanes   0   1   2   3   4        A step is a row of heights, one in each lane. Lines of light pass through all
///   step 0  o\  o\  o\  o\  o\       steps, a lane's width apart, and drift by `shift` lanes at each. For an edge of
///   step 1  o \ o \ o \ o \ o \      the sun a line carries its caster: its height, how many steps ago it was, and how
///   step 2  o  \o  \o  \o  \o        its shadow rises towards the next lane. A line meets the ground on each step, and
///                                    where it crosses a side of a triangle between two steps. Ground that rises above
///                                    the line's shadow becomes its caster. Nothing else mixes lines: a shadow stays as
///                                    sharp after a thousand steps as it was.
///
/// A vertex is shaded by the ground one step before it, exactly, and by what the two lines beside it met until then:
///
///   step n-1   o-----x----o    x: the last ground that the vertex' own light crosses, between two lanes
///               |     \        |: lines, which know all ground up to this step
///   step n     o-|-----V--|-o
///
/// A caster on a straight side gives a shadow that is linear from line to line, so that each line's shadow can be
/// continued to the vertex.

namespace isohf {

/// One edge of the sun's disc: the highest ground that its light passes casts the shadow. All in the unit of heights.
struct SunEdge {
  double fall = 1.0;      ///< of its shadow at a step, > 0
  double widening = 0.0;  ///< of the penumbra at a step, >= 0
  /// From its shadow's border to the height where half of the sun is hidden: side * width of the penumbra + offset.
  double side = 0.0;
  double offset = 0.0;
  /// A penumbra counts as no narrower than least + widths * steep, up to `most`. least + widening > 0
  double least = 0.0;
  double steep = 0.0;
  double most = 0.0;
  /// Depths in the shadow are clamped to max(deepest, width of the penumbra), so that a border between deep shadow and
  /// none lies midway, and heights above it to max(highest, that width). Of two lines beside a lane both are clamped to
  /// the first.
  double deepest = 0.0;
  double highest = 0.0;
};

/// The lines of light over one band of lanes.
class ShadowFront {
 public:
  /// Whether lanes run along sides of triangles, so that a line that passes over a lane crosses one.
  enum class Lanes { kAreSides, kAreNone };

  /// lanes  at least 1
  /// shift  lanes that the light drifts by at a step, 0 to 1. At 0 and 1 the lines pass through the lanes
  /// edges  of the sun, at least one; the one that hides more counts
  /// range  the hidden part lies between 1/2 - range and 1/2 + range; > 1/2
  ShadowFront(int lanes, Lanes kind, double shift, const std::vector<SunEdge>& edges, double range);

  /// Numbers behind an array that vectors reach over its end.
  static constexpr int kOverrun = 32;

  /// The ground on a step.
  struct Step {
    /// [-1...lanes], NaN if nodata; the two beyond the lanes are NaN, or ground. kOverrun more may be read. Null: no
    /// ground at all.
    const float* heights = nullptr;
    /// Lanes whose ground casts shadows: first to last, fractional; none if last < first.
    double first_casting = 1.0;
    double last_casting = 0.0;
    /// Every second lane has a vertex: 0 if lane 0 has, else 1. The lanes without are those of the steps beside it.
    int vertex_lane = 0;
    /// Lanes that have a vertex besides: every so many from lane 0 on; 0: none.
    int more_vertices = 0;
  };

  /// Moves on by one step, from `before` to `here`.
  /// hidden  [lanes + 1 + kOverrun] out, of the vertices of `here`: those of every second lane in order, and from
  ///         first_of_more() on those of more_vertices. 0 or less if all of the sun is seen, 1 or more if none of it
  ///         is; null: not wanted
  void advance(const Step& before, const Step& here, float* hidden);

  [[nodiscard]] static int first_of_more(int lanes) { return (lanes + 1) / 2; }

  /// Whether the step to come moves each line on to the next lane.
  [[nodiscard]] bool is_shifting() const;
  /// Numbers that a line carries.
  [[nodiscard]] std::size_t carried() const { return carried_by(edges_.size()); }
  [[nodiscard]] static std::size_t carried_by(std::size_t edges) { return 3 * edges; }
  /// Appends the numbers of the line that lies between `lane` and lane + 1 after that step, before it falls.
  void append_arriving(int lane, std::vector<float>& to) const;
  /// Gives the line that arrives between lane 0 and 1 its numbers, from the band before; null: nothing.
  void let_in(const float* carried);

  /// The numbers of all lines, [edges][casters' heights, steps since, rise to the next lane][lanes + 1].
  [[nodiscard]] std::vector<float> lines() const;
  /// Continues from them; the next step is number `step`. Empty: nothing casts yet.
  void resume(std::int64_t step, const std::vector<float>& lines);

 private:
  [[nodiscard]] float* line(std::size_t number) { return lines_.data() + number * stride_ + origin_; }
  [[nodiscard]] const float* line(std::size_t number) const { return lines_.data() + number * stride_ + origin_; }
  void shift_lines();
  void shade(const Step& before, const Step& here, double share, float* hidden);
  void meet(const Step& before, const Step& here, double share, bool is_over_lane);

  Lanes kind_;
  double shift_;
  std::vector<SunEdge> edges_;
  float range_;
  std::int64_t steps_ = 0;
  std::size_t count_;   ///< lanes + 1; line l lies between lanes l - 1 and l
  std::size_t stride_;  ///< with room before the lines, so that they need not be copied at each shift, and kOverrun
  std::size_t origin_;  ///< of line 0 in a row of lines_
  std::vector<float> lines_;  ///< [carried()][stride_]
};

}  // namespace isohf
