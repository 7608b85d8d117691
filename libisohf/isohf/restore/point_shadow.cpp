#include "isohf/restore/point_shadow.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "isohf/archive/codec/quantise.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/restore/shade/light.h"
#include "isohf/surface/shade/shadow.h"

namespace isohf {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;

void require(bool holds, const char* what) {
  if (!holds) throw Error(ErrorCode::kInvalidArgument, what);
}

}  // namespace

PointShadow::PointShadow(const ArchiveReader& archive, const Sun& sun, double above)
    : archive_(archive),
      towards_sun_{std::sin(sun.azimuth_deg * kRadians), -std::cos(sun.azimuth_deg * kRadians)},
      fall_(std::tan(sun.elevation_deg * kRadians) * sun.elevation_units_per_world_unit),
      softness_(sun.softness.value_or(default_softness(archive.metadata()))),
      above_(above),
      highest_(-std::numeric_limits<double>::infinity()) {
  require(std::isfinite(sun.azimuth_deg), "the sun's azimuth must be a number of degrees");
  require(sun.elevation_deg > 0.0 && sun.elevation_deg < 90.0, "the sun must stand above 0 and below 90 degrees");
  require(sun.elevation_units_per_world_unit > 0.0, "the elevation units in one world unit must be above 0");
  require(softness_ > 0.0, "the sun's apparent size must be above 0");
  require(above >= 0.0 && std::isfinite(above), "heights above the surface must be 0 or more");
  const MemberTable& tiles = archive.tables().front();
  if (tiles.stored > 0) highest_ = elevation_from_index(tiles.code_max);
}

double PointShadow::elevation_from_index(std::uint32_t code) const {
  const Quantisation& quantisation = archive_.metadata().quantisation;
  return quantisation.type == CodeType::kF32 ? static_cast<double>(std::bit_cast<float>(code))
                                             : elevation_from_code(quantisation, code);
}

/// S at the line's beginning, where tiles between it and the part begin <= t <= end have found it `so_far`. Between
/// crossings the surface is straight: its greatest height above the falling line is at one of them.
double PointShadow::highest_on(const ObjectLine& line, double begin, double end, const TileCodes& codes,
                               double so_far) const {
  const TileShape& shape = archive_.grid().shape();
  const Quantisation& quantisation = archive_.metadata().quantisation;
  auto sides = side_crossings(line, begin);
  for (double t = begin;; t = std::clamp(pass_first(sides), t, end)) {
    const double elevation = elevation_at(shape, codes, quantisation, snapped(barycentric(shape, line.at(t))));
    if (elevation - t * fall_ > so_far) so_far = elevation - t * fall_;  // not where void, NaN
    if (t >= end) return so_far;
  }
}

double PointShadow::height(WorldPoint at, double elevation, PointSampler& tiles) const {
  const TileGrid& grid = archive_.grid();
  const WorldBounds& ground = archive_.metadata().valid;
  double shadow = elevation;
  double begin = 0.0;
  double end = std::numeric_limits<double>::infinity();
  cut_line(at.x, towards_sun_.x, std::max(ground.x0, 0.0), std::min(ground.x1, grid.world_width()), begin, end);
  cut_line(at.z, towards_sun_.z, std::max(ground.z0, 0.0), std::min(ground.z1, grid.world_height()), begin, end);
  auto borders = tile_crossings(grid, at, towards_sun_, begin);
  for (double from = begin; from < end && highest_ - from * fall_ > shadow;) {
    const double to = std::clamp(pass_first(borders), from, end);
    const double middle = 0.5 * (from + to);
    const TileIndex tile = grid.locate({at.x + middle * towards_sun_.x, at.z + middle * towards_sun_.z}).tile;
    const TileEntry entry = archive_.tile_entry(tile);
    if (to > from && entry.stored && elevation_from_index(entry.code_max) - from * fall_ > shadow) {
      const ObjectLine line = object_line(grid, tile, at, towards_sun_);
      shadow = highest_on(line, from, to, *tiles.codes(tile), shadow);
    }
    from = to;
  }
  return shadow;
}

void PointShadow::sample(std::span<const WorldPoint> points, std::span<const double> elevations, PointSampler& tiles,
                         std::span<SunSample> samples) const {
  ISOHF_ASSERT(points.size() == elevations.size() && points.size() == samples.size());
  oneapi::tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    if (std::isnan(elevations[i])) {
      samples[i] = {elevations[i], elevations[i]};
      return;
    }
    const double shadow = height(points[i], elevations[i], tiles);
    const double y = elevations[i] + above_;
    samples[i] = {shadow, above_ > 0.0 ? sun_share(y, shadow, softness_) : sun_share_on_surface(y, shadow, softness_)};
  });
}

}  // namespace isohf
