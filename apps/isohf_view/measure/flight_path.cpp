#include "measure/flight_path.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "isohf/error.h"

namespace isohf::view {
namespace {

Vec3 curve(Vec3 before, Vec3 from, Vec3 to, Vec3 after, double t) {
  const double t2 = t * t;
  const double t3 = t2 * t;
  return 0.5 * ((2.0 * from) + t * (to - before) + t2 * (2.0 * before - 5.0 * from + 4.0 * to - after) +
                t3 * (3.0 * from - before - 3.0 * to + after));
}

}  // namespace

FlightPath::FlightPath(std::vector<Waypoint> waypoints) : waypoints_(std::move(waypoints)) {
  if (waypoints_.size() < 2) throw Error(ErrorCode::kInvalidArgument, "a flight needs at least two places");
  for (std::size_t i = 1; i < waypoints_.size(); ++i) {
    if (!(waypoints_[i].time_s > waypoints_[i - 1].time_s)) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("place {}: its time {} s does not come after {} s", i + 1,
                                                           waypoints_[i].time_s, waypoints_[i - 1].time_s));
    }
  }
}

FlightPath FlightPath::read(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw Error(ErrorCode::kIo, path + ": cannot be opened");
  std::vector<Waypoint> waypoints;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line.resize(std::min(line.size(), line.find('#')));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    std::istringstream fields(line);
    Waypoint at;
    std::string rest;
    fields >> at.time_s >> at.eye.x >> at.eye.y >> at.eye.z >> at.target.x >> at.target.y >> at.target.z;
    if (!fields || (fields >> rest)) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("{}: line {}: seven numbers are required: seconds x y z look_x look_y look_z", path, number));
    }
    waypoints.push_back(at);
  }
  try {
    return FlightPath(std::move(waypoints));
  } catch (const Error& error) {
    throw error.within(path);
  }
}

Waypoint FlightPath::at(double time_s) const {
  const auto next = std::upper_bound(waypoints_.begin(), waypoints_.end(), time_s,
                                     [](double time, const Waypoint& waypoint) { return time < waypoint.time_s; });
  const auto count = static_cast<std::ptrdiff_t>(waypoints_.size());
  const std::ptrdiff_t i = std::clamp<std::ptrdiff_t>(next - waypoints_.begin() - 1, 0, count - 2);
  const auto pick = [&](std::ptrdiff_t k) -> const Waypoint& {
    return waypoints_[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(k, 0, count - 1))];
  };
  const Waypoint& a = pick(i);
  const Waypoint& b = pick(i + 1);
  const double t = std::clamp((time_s - a.time_s) / (b.time_s - a.time_s), 0.0, 1.0);
  return {time_s, curve(pick(i - 1).eye, a.eye, b.eye, pick(i + 2).eye, t),
          curve(pick(i - 1).target, a.target, b.target, pick(i + 2).target, t)};
}

}  // namespace isohf::view
