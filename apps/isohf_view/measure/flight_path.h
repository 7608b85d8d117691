#pragma once

#include <string>
#include <vector>

#include "gl/vec.h"

namespace isohf::view {

/// A place on a flight; y before exaggeration.
struct Waypoint {
  double time_s = 0.0;
  Vec3 eye;
  Vec3 target;
};

/// A path through two or more waypoints, smooth in place and direction (Catmull-Rom).
class FlightPath {
 public:
  /// Reads 'seconds x y z look_x look_y look_z' a line; '#' begins a comment. Throws Error{kIo, kInvalidArgument}
  /// naming file and line.
  static FlightPath read(const std::string& path);
  /// waypoints: at least two, times rising. Throws Error{kInvalidArgument}.
  explicit FlightPath(std::vector<Waypoint> waypoints);

  [[nodiscard]] double begin_s() const { return waypoints_.front().time_s; }
  [[nodiscard]] double end_s() const { return waypoints_.back().time_s; }
  /// Times outside are moved to the ends.
  [[nodiscard]] Waypoint at(double time_s) const;

 private:
  std::vector<Waypoint> waypoints_;
};

}  // namespace isohf::view
