#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "isohf/convert.h"
#include "isohf/convert/frame/source_frame.h"
#include "isohf/lattice.h"
#include "isohf/raster.h"

namespace isohf {

/// Everything that is decided before a sample is read.
struct Plan {
  SourceFrame frame;
  TileGrid grid;
  double density = 1.0;               ///< lattice samples for one source sample, as it came out
  std::int64_t lattice_samples = 0;   ///< C*R for all tiles
  std::uint64_t estimated_bytes = 0;  ///< of the archive, from typical bits per sample; an estimate
};

/// Chooses shape, spacing and tile grid. Throws Error{kInvalidArgument} naming the option at fault; a shape that breaks
/// a constraint is answered with the nearest valid one. Sources of fewer than 2x2 samples are refused.
[[nodiscard]] Plan make_plan(const SourceInfo& info, const PlanRequest& request);

/// Whether every sample can be a vertex of equal tiles.
[[nodiscard]] bool can_go_through_samples(const SourceFrame& frame, const PlanRequest& request);

/// The shapes that suit a request without an input: the best by true aspect near the budget.
[[nodiscard]] std::vector<TileShape> candidate_shapes(const PlanRequest& request, int limit);

/// What a plan lacks that was asked for: tiles that end on the source's edge.
[[nodiscard]] std::vector<Warning> plan_warnings(const SourceInfo& info, const Plan& plan, const PlanRequest& request);

}  // namespace isohf
