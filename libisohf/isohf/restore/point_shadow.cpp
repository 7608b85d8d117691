#include "isohf/restore/point_shadow.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "isohf/archive/tile/quantise.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/light/shadow.h"

namespace isohf {
namespace {

constexpr double kRadians = std::numbers::pi / 180.0;
/// Lattice steps: rises to what is nearer are roundings; the same triangle has another place farther on.
constexpr double kNearest = 1e-6;

void require(bool holds, const char* what) {
  if (!holds) throw Error(ErrorCode::kInvalidArgument, what);
}

}  // namespace

PointShadow::PointShadow(const ArchiveReader& archive, const Sun& sun, double above)
    : archive_(archive),
      scale_(ground_scale(archive.metadata())),
      grid_m_(scaled(archive.grid(), scale_)),
      towards_sun_{std::sin(sun.azimuth_deg * kRadians), -std::cos(sun.azimuth_deg * kRadians)},
      sun_(swept_sun(sun.azimuth_deg, sun.elevation_deg, sun_radius_deg(archive.metadata().source.body), 1.0,
                     1.0 / scale_.elevation)),
      units_(1.0 / scale_.elevation),
      elevation_deg_(sun.elevation_deg),
      above_(above),
      highest_(-std::numeric_limits<double>::infinity()) {
  require(std::isfinite(sun.azimuth_deg), "the sun's azimuth must be a number of degrees");
  require(sun.elevation_deg > 0.0 && sun.elevation_deg < 90.0, "the sun must stand above 0 and below 90 degrees");
  sun_.softness = sun.softness;
  radius_deg_ = elevation_deg_ - std::atan(sun_.lower_fall / units_) / kRadians;
  require(sun_.softness.value_or(1.0) > 0.0, "the sun's apparent size must be above 0");
  require(above >= 0.0 && std::isfinite(above), "heights above the surface must be 0 or more");
  const MemberTable& tiles = archive.tables().front();
  if (tiles.stored > 0) highest_ = elevation_from_index(tiles.code_max);
}

double PointShadow::elevation_from_index(std::uint32_t code) const {
  const Quantisation& quantisation = archive_.metadata().quantisation;
  return quantisation.type == CodeType::kF32 ? static_cast<double>(std::bit_cast<float>(code))
                                             : elevation_from_code(quantisation, code);
}

/// Between crossings the surface is straight: its greatest height above a line from y, or a falling one, is at one of
/// them.
void PointShadow::look_over(const ObjectLine& line, double begin, double end, const TileCodes& codes,
                            Horizon& seen) const {
  const TileShape& shape = grid_m_.shape();
  const Quantisation& quantisation = archive_.metadata().quantisation;
  const double nearest = kNearest * grid_m_.sigma_x();
  auto sides = side_crossings(line, begin);
  for (double t = begin;; t = std::clamp(pass_first(sides), t, end)) {
    const double elevation = elevation_at(shape, codes, quantisation, snapped(barycentric(shape, line.at(t))));
    // Not where void, NaN.
    if (elevation - t * sun_.fall > seen.shadow) seen.shadow = elevation - t * sun_.fall;
    if (t > nearest && elevation - seen.y > t * seen.rise) seen.rise = (elevation - seen.y) / t;
    if (t >= end) return;
  }
}

/// Whether ground up to that elevation, from that distance on, can change what is seen.
bool PointShadow::can_hide(double highest, double distance, const Horizon& seen) const {
  if (highest - distance * sun_.fall > seen.shadow) return true;
  return !sun_.softness && highest - distance * std::max(seen.rise, sun_.lower_fall) > seen.y;
}

void PointShadow::look(WorldPoint place, PointSampler& tiles, Horizon& seen) const {
  const TileGrid& grid = grid_m_;
  const WorldBounds ground = scaled(archive_.metadata().valid, scale_);
  const WorldPoint at{place.x * scale_.x, place.z * scale_.z};
  double begin = 0.0;
  double end = std::numeric_limits<double>::infinity();
  cut_line(at.x, towards_sun_.x, std::max(ground.x0, 0.0), std::min(ground.x1, grid.world_width()), begin, end);
  cut_line(at.z, towards_sun_.z, std::max(ground.z0, 0.0), std::min(ground.z1, grid.world_height()), begin, end);
  auto borders = tile_crossings(grid, at, towards_sun_, begin);
  for (double from = begin; from < end && can_hide(highest_, from, seen);) {
    const double to = std::clamp(pass_first(borders), from, end);
    const double middle = 0.5 * (from + to);
    const TileIndex tile = grid.locate({at.x + middle * towards_sun_.x, at.z + middle * towards_sun_.z}).tile;
    const TileEntry entry = archive_.tile_entry(tile);
    if (to > from && entry.stored && can_hide(elevation_from_index(entry.code_max), from, seen)) {
      look_over(object_line(grid, tile, at, towards_sun_), from, to, *tiles.codes(tile), seen);
    }
    from = to;
  }
}

double PointShadow::share(const Horizon& seen) const {
  if (sun_.softness) {
    return above_ > 0.0 ? sun_share(seen.y, seen.shadow, *sun_.softness)
                        : sun_share_on_surface(seen.y, seen.shadow, *sun_.softness);
  }
  // The disc as a segment between its edges, as it is swept (decision 64).
  const double horizon_deg = std::atan(seen.rise / units_) / kRadians;
  return std::clamp(0.5 + (elevation_deg_ - horizon_deg) / (2.0 * radius_deg_), 0.0, 1.0);
}

void PointShadow::sample(std::span<const WorldPoint> points, std::span<const double> elevations, PointSampler& tiles,
                         std::span<SunSample> samples) const {
  ISOHF_ASSERT(points.size() == elevations.size() && points.size() == samples.size());
  oneapi::tbb::parallel_for(std::size_t{0}, points.size(), [&](std::size_t i) {
    if (std::isnan(elevations[i])) {
      samples[i] = {elevations[i], elevations[i]};
      return;
    }
    Horizon seen{elevations[i] + above_, elevations[i], -std::numeric_limits<double>::infinity()};
    look(points[i], tiles, seen);
    samples[i] = {seen.shadow, share(seen)};
  });
}

}  // namespace isohf
