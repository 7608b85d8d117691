#include "isohf/surface/source/source_geometry.h"

#include <algorithm>
#include <cmath>

#include "isohf/surface/resample/tile_cutter.h"
#include "isohf/surface/resample/warped_cutter.h"

namespace isohf {
namespace {

/// Beyond this many samples no slope goes on: next to a pole a lattice step crosses any number of columns.
constexpr double kMostContinued = 256.0;

/// Samples that kContinuedSteps lattice steps cross at most, along u and v, anywhere on the source's border.
SourcePosition continued_samples(const TileGrid& grid, const WarpPlace& place) {
  const ExactWarp warp(place);
  constexpr int kPlaces = 64;
  const auto last_u = static_cast<double>(place.width - 1);
  const auto last_v = static_cast<double>(place.height - 1);
  const double steps[2][2] = {{2.0 * grid.sigma_x(), 0.0}, {0.0, grid.sigma_z()}};
  SourcePosition most;
  const auto look_at = [&](double u, double v) {
    const WorldPoint world = warp.world_from_source({u, v});
    for (const auto& step : steps) {
      const SourcePosition there = warp.source_from_world({world.x + step[0], world.z + step[1]});
      const double across = std::remainder(there.u - u, place.columns_round());
      most.u = std::max(most.u, std::abs(across));  // a NaN is passed over
      most.v = std::max(most.v, std::abs(there.v - v));
    }
  };
  for (int i = 0; i <= kPlaces; ++i) {
    const double share = static_cast<double>(i) / kPlaces;
    look_at(share * last_u, 0.0);
    look_at(share * last_u, last_v);
    look_at(0.0, share * last_v);
    look_at(last_u, share * last_v);
  }
  // Upwards to a sixteenth: last bits of the projection must not decide what is void.
  const auto rounded = [](double samples) {
    return std::min(std::ceil(kContinuedSteps * samples * 16.0 + 0.01) / 16.0, kMostContinued);
  };
  return {rounded(most.u), rounded(most.v)};
}

}  // namespace

SourceAxes make_axes(const TileGrid& grid, const SourceGeometry& geometry) {
  if (geometry.warp) {
    const SourcePosition continued = continued_samples(grid, *geometry.warp);
    const auto along = [&](std::int64_t samples, double steps) {
      return SourceAxis::of_positions(samples, geometry.registration, geometry.outside, steps);
    };
    return {geometry.wraps_x ? SourceAxis::wrapping(geometry.width, 0.0, 1.0) : along(geometry.width, continued.u),
            along(geometry.height, continued.v)};
  }
  const SourceAxis z(geometry.height, geometry.first_sample_z, geometry.spacing_z, geometry.registration,
                     geometry.outside, kContinuedSteps * grid.sigma_z());
  if (geometry.wraps_x) {
    return {SourceAxis::wrapping(geometry.width, geometry.first_sample_x, geometry.spacing_x), z};
  }
  return {SourceAxis(geometry.width, geometry.first_sample_x, geometry.spacing_x, geometry.registration,
                     geometry.outside, kContinuedSteps * 2.0 * grid.sigma_x()),
          z};
}

std::unique_ptr<VertexCutter> make_cutter(const TileGrid& grid, const SourceGeometry& geometry, const Kernel& kernel,
                                          const ElevationRange& limits) {
  const auto [x, z] = make_axes(grid, geometry);
  if (geometry.warp) {
    return std::make_unique<WarpedCutter>(grid, *geometry.warp, x, z, geometry.outside, kernel, limits);
  }
  return std::make_unique<TileCutter>(grid, x, z, kernel, limits);
}

}  // namespace isohf
