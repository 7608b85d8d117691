#include "ground.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/lattice/crossings.h"

namespace isohf::view {
namespace {

constexpr std::size_t kTilesKept = 48;
constexpr double kNever = std::numeric_limits<double>::infinity();

bool holds(const WorldBounds& bounds, WorldPoint at) {
  return at.x >= bounds.x0 && at.x <= bounds.x1 && at.z >= bounds.z0 && at.z <= bounds.z1;
}

}  // namespace

const Ground::Kept& Ground::kept(TileIndex tile) {
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& one) { return one.tile == tile; });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
    return kept_.front();
  }
  Kept fresh{tile, {}};
  std::vector<std::uint16_t> codes(static_cast<std::size_t>(source_.grid().shape().stored_vertex_count()));
  try {
    source_.read(tile, codes);
    fresh.codes.resize(codes.size());
    std::transform(codes.begin(), codes.end(), fresh.codes.begin(), [](std::uint16_t code) {
      return code == kVoidCode ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(code);
    });
  } catch (const Error&) {
    fresh.codes.clear();
  }
  if (kept_.size() == kTilesKept) kept_.pop_back();
  kept_.push_front(std::move(fresh));
  return kept_.front();
}

double Ground::height_in(const Kept& tile, ObjectPoint point) const {
  if (tile.codes.empty()) return std::numeric_limits<double>::quiet_NaN();
  const TileShape& shape = source_.grid().shape();
  const ViewScale scale = source_.scale();
  const View2D<const float> codes(tile.codes.data(), shape.columns(), shape.rows());
  return scale.offset + scale.scale * interpolate(barycentric(shape, point), codes);
}

std::optional<double> Ground::height(WorldPoint at) {
  const TileGrid& grid = source_.grid();
  if (!grid.contains(at) || !holds(source_.covered(), at)) return std::nullopt;
  const TilePoint place = grid.locate(at);
  if (!source_.bounds(place.tile).stored) return std::nullopt;
  const double found = height_in(kept(place.tile), place.point);
  return std::isnan(found) ? std::nullopt : std::optional(found);
}

std::optional<double> Ground::highest(WorldPoint at) const {
  const TileGrid& grid = source_.grid();
  if (!grid.contains(at)) return std::nullopt;
  const TileBounds bounds = source_.bounds(grid.locate(at).tile);
  return bounds.stored ? std::optional(bounds.high) : std::nullopt;
}

std::optional<double> Ground::hit_in(const Kept& tile, const Ray& ray, double begin, double end) const {
  const ObjectLine line = object_line(source_.grid(), tile.tile, {ray.from.x, ray.from.z}, {ray.along.x, ray.along.z});
  auto sides = side_crossings(line, begin);
  const auto above = [&](double t) {
    return ray.from.y + t * ray.along.y - ray.exaggeration * height_in(tile, line.at(t));
  };
  double from = begin;
  double height_from = above(from);
  while (from < end) {
    const double to = std::clamp(pass_first(sides), from, end);
    const double height_to = above(to);
    if (height_from * height_to <= 0.0 && !std::isnan(above(0.5 * (from + to)))) {
      const double fall = height_from - height_to;
      return fall == 0.0 ? from : from + (to - from) * height_from / fall;
    }
    from = to;
    height_from = height_to;
  }
  return std::nullopt;
}

std::optional<Vec3> Ground::hit(Vec3 eye, Vec3 direction, double exaggeration) {
  if (!whole_.stored) return std::nullopt;
  const TileGrid& grid = source_.grid();
  const WorldBounds covered = source_.covered();
  const Ray ray{eye, normalised(direction), exaggeration};
  const double slack = 1e-9 * (1.0 + std::abs(whole_.high) + std::abs(whole_.low)) * exaggeration;
  double begin = 0.0;
  double end = kNever;
  cut_line(eye.x, ray.along.x, std::max(covered.x0, 0.0), std::min(covered.x1, grid.world_width()), begin, end);
  cut_line(eye.z, ray.along.z, std::max(covered.z0, 0.0), std::min(covered.z1, grid.world_height()), begin, end);
  cut_line(eye.y, ray.along.y, whole_.low * exaggeration - slack, whole_.high * exaggeration + slack, begin, end);
  if (!(begin <= end) || end == kNever) return std::nullopt;
  const auto at = [&](double t) { return ray.from + t * ray.along; };
  auto borders = tile_crossings(grid, {eye.x, eye.z}, {ray.along.x, ray.along.z}, begin);
  for (double from = begin; from <= end;) {
    const double to = std::clamp(pass_first(borders), from, end);
    const Vec3 middle = at(0.5 * (from + to));
    const TileIndex tile = grid.locate({middle.x, middle.z}).tile;
    const TileBounds bounds = source_.bounds(tile);
    const double low = std::min(at(from).y, at(to).y);
    const double high = std::max(at(from).y, at(to).y);
    if (bounds.stored && low <= bounds.high * exaggeration + slack && high >= bounds.low * exaggeration - slack) {
      if (const auto met = hit_in(kept(tile), ray, from, to)) return at(*met);
    }
    if (to >= end) break;
    from = to;
  }
  return std::nullopt;
}

}  // namespace isohf::view
