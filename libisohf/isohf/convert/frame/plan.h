#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/convert/frame/source_frame.h"
#include "isohf/lattice.h"
#include "isohf/raster.h"
#include "isohf/surface/source/source_axis.h"

namespace isohf {

/// What a user asks of the lattice and its tiles. At most one of density, spacing and tiles is given; at most one of
/// shape and budget.
struct PlanRequest {
  std::optional<std::pair<int, int>> shape;  ///< C, R; nullopt: chosen
  std::optional<int> levels;                 ///< Λ; nullopt: 4, or fewer for small sources
  std::optional<ShapeBudget> budget;         ///< of one tile
  std::optional<double> density;             ///< lattice samples for one source sample, > 0; nullopt: 1
  std::optional<double> spacing;             ///< lattice column step, world units, > 0
  std::optional<std::pair<std::int64_t, std::int64_t>> tiles;  ///< tile columns, rows
  /// Instead: a column for each of the source's and two rows for each, so that every sample is a vertex: twice as many
  /// vertices as samples. Not for sources that are projected or joined.
  bool through_samples = false;
  bool fit = false;  ///< stretch the extents a little so that tiles end on the source's edge
  Outside outside = Outside::kCover;
  GroundRequest ground;
};

/// Everything that is decided before a sample is read.
struct Plan {
  SourceFrame frame;
  TileGrid grid;
  Outside outside = Outside::kCover;
  double density = 1.0;               ///< lattice samples for one source sample, as it came out
  std::int64_t lattice_samples = 0;   ///< C*R for all tiles
  double band_rows = 0.0;             ///< source rows that a row of tiles reads, at most, without the kernel's taps
  std::uint64_t estimated_bytes = 0;  ///< of the archive, from typical bits per sample; an estimate
};

/// Chooses shape, spacing and tile grid. Throws Error{kInvalidArgument} naming the option at fault; a shape that breaks
/// a constraint is answered with the nearest valid one. Sources of fewer than 2x2 samples are refused.
[[nodiscard]] Plan make_plan(const SourceInfo& info, const PlanRequest& request);

/// The shapes that `isohf plan` lists for a request without an input: the best by true aspect near the budget.
[[nodiscard]] std::vector<TileShape> candidate_shapes(const PlanRequest& request, int limit);

/// What a plan has that nobody asked for: a density below 0.5 or above 2. One line each, with the figure and a remedy.
[[nodiscard]] std::vector<std::string> plan_warnings(const SourceInfo& info, const Plan& plan,
                                                     const PlanRequest& request);

}  // namespace isohf
