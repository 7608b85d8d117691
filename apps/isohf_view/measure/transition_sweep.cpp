#include "measure/transition_sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "gl/offscreen.h"

namespace isohf::view {
namespace {

using Picture = std::vector<std::uint8_t>;

void compare(const Picture& a, const Picture& b, int& largest, double& mean) {
  std::int64_t sum = 0;
  largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int off = std::abs(a[i] - b[i]);
    largest = std::max(largest, off);
    sum += off;
  }
  mean = static_cast<double>(sum) / (0.75 * static_cast<double>(a.size()));  // alpha never differs
}

}  // namespace

SweepResult sweep_levels(Session& session, int steps, bool plain_switching) {
  const Offscreen target(session.view.width, session.view.height, GL_RGBA8);
  const double last = std::min(2, session.source().grid().shape().levels() - 1);
  session.view.plain_switching = plain_switching;
  SweepResult result;
  Picture before;
  Picture start;
  int start_level = -1;
  double from_start_before = 0.0;
  for (int i = 0; i <= steps; ++i) {
    SweepStep step;
    step.level = last * i / steps;
    session.view.fixed_level = step.level;
    target.bind();
    session.complete_frame();
    Picture picture = target.read_rgba8();
    if (i == 0) before = picture;
    compare(picture, before, step.largest_jump, step.mean_jump);
    // A picture at a whole level ends one span and begins the next.
    int ignored = 0;
    if (!start.empty()) {
      compare(picture, start, ignored, step.from_start);
      result.largest_retreat = std::max(result.largest_retreat, from_start_before - step.from_start);
      from_start_before = step.from_start;
    }
    const double whole = std::floor(step.level + 1e-9);
    if (static_cast<int>(whole) != start_level && step.level - whole < 1e-9) {
      start_level = static_cast<int>(whole);
      start = picture;
      from_start_before = 0.0;
    }
    result.largest_jump = std::max(result.largest_jump, step.largest_jump);
    result.largest_mean_jump = std::max(result.largest_mean_jump, step.mean_jump);
    result.steps.push_back(step);
    before = std::move(picture);
  }
  return result;
}

}  // namespace isohf::view
