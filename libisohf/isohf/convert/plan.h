#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive/metadata.h"
#include "isohf/lattice/tile_grid.h"
#include "isohf/surface/heightmap.h"
#include "isohf/surface/source_axis.h"

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
  bool fit = false;  ///< stretch the extents a little so that tiles end on the source's edge
  Outside outside = Outside::kCover;
};

/// Where the source's samples lie in world space.
struct SourceFrame {
  std::int64_t width = 0;
  std::int64_t height = 0;
  Registration registration = Registration::kPoint;  ///< as used, never kUnknown
  double first_sample_x = 0.0;                       ///< world place of sample (0, 0)
  double first_sample_z = 0.0;
  double spacing_x = 1.0;  ///< world units between neighbouring columns and rows
  double spacing_z = 1.0;
  bool in_metres = false;  ///< world units are metres; else the source's own units

  /// The part of the world that the source covers: pixel areas, or posts.
  [[nodiscard]] WorldBounds bounds() const;
};

/// Degrees become metres on the declared ellipsoid (WGS 84 where none is declared) at the raster's middle latitude, x
/// along the parallel and z along the meridian. Unknown registration counts as point where the source has no
/// georeference, else as area. Throws Error{kInvalidArgument} for latitudes beyond the poles.
[[nodiscard]] SourceFrame make_source_frame(const SourceInfo& info);

/// Everything that is decided before a sample is read.
struct Plan {
  SourceFrame frame;
  TileGrid grid;
  Outside outside = Outside::kCover;
  double density = 1.0;               ///< lattice samples for one source sample, as it came out
  std::int64_t lattice_samples = 0;   ///< C*R for all tiles
  std::uint64_t estimated_bytes = 0;  ///< of the archive, from typical bits per sample; an estimate
};

/// Chooses shape, spacing and tile grid. Throws Error{kInvalidArgument} naming the option at fault; a shape that breaks
/// a constraint is answered with the nearest valid one. Sources of fewer than 2x2 samples are refused.
[[nodiscard]] Plan make_plan(const SourceInfo& info, const PlanRequest& request);

/// The shapes that `isohf plan` lists for a request without an input: the best by true aspect near the budget.
[[nodiscard]] std::vector<TileShape> candidate_shapes(const PlanRequest& request, int limit);

}  // namespace isohf
