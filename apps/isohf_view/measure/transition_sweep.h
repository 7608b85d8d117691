#pragma once

#include <vector>

#include "session.h"

namespace isohf::view {

/// How the picture differs from the one before and from those at both ends, in 8-bit steps of a channel.
struct SweepStep {
  double level = 0.0;
  int largest_jump = 0;  ///< of any pixel and channel, from the step before
  double mean_jump = 0.0;
  double from_start = 0.0;  ///< mean difference from the picture at the last whole level
};

struct SweepResult {
  std::vector<SweepStep> steps;
  int largest_jump = 0;
  double largest_mean_jump = 0.0;
  /// Largest fall of from_start between two steps within one level: 0 means that the picture moves steadily away.
  double largest_retreat = 0.0;
};

/// Draws the session's view with all tiles at levels 0, 2/steps, ... 2 (as far as the archive has levels), offscreen;
/// with `plain_switching` levels are rounded in place of fading.
[[nodiscard]] SweepResult sweep_levels(Session& session, int steps, bool plain_switching);

}  // namespace isohf::view
