#include "ground.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"

namespace isohf::view {
namespace {

constexpr std::size_t kTilesKept = 48;
constexpr double kNever = std::numeric_limits<double>::infinity();

/// Where a ray's coordinate passes the multiples of a step, one after the other.
class Crossings {
 public:
  /// The coordinate is `at` + t * `rate`; passes from `begin` on.
  Crossings(double at, double rate, double step, double begin) : at_(at), rate_(rate), step_(step) {
    if (rate == 0.0) return;
    const double place = (at + begin * rate) / step;
    multiple_ = rate > 0.0 ? std::floor(place) + 1.0 : std::ceil(place) - 1.0;
  }
  [[nodiscard]] double next() const { return rate_ == 0.0 ? kNever : (multiple_ * step_ - at_) / rate_; }
  void pass() { multiple_ += rate_ > 0.0 ? 1.0 : -1.0; }

 private:
  double at_;
  double rate_;
  double step_;
  double multiple_ = 0.0;
};

/// Shortens begin..end to where from + t * along lies in low..high.
void cut(double from, double along, double low, double high, double& begin, double& end) {
  if (along == 0.0) {
    if (from < low || from > high) end = -kNever;
    return;
  }
  const double first = (low - from) / along;
  const double second = (high - from) / along;
  begin = std::max(begin, std::min(first, second));
  end = std::min(end, std::max(first, second));
}

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

std::optional<double> Ground::height(WorldPoint at, const WorldBounds& shown) {
  const TileGrid& grid = source_.grid();
  if (!grid.contains(at) || !holds(shown, at)) return std::nullopt;
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

/// The surface under a ray is a chain of straight pieces that meet where the ray crosses a side of a triangle: in object
/// space these lie on z = k, x + z = 2k and x - z = 2k, whole k, the half triangles' among them.
std::optional<double> Ground::hit_in(const Kept& tile, const Ray& ray, double begin, double end) const {
  const TileGrid& grid = source_.grid();
  const double x = (ray.from.x - static_cast<double>(tile.tile.column) * grid.extent_x()) / grid.sigma_x();
  const double z = (ray.from.z - static_cast<double>(tile.tile.row) * grid.extent_z()) / grid.sigma_z();
  const double dx = ray.along.x / grid.sigma_x();
  const double dz = ray.along.z / grid.sigma_z();
  std::array<Crossings, 3> sides{Crossings(z, dz, 1.0, begin), Crossings(x + z, dx + dz, 2.0, begin),
                                 Crossings(x - z, dx - dz, 2.0, begin)};
  const auto above = [&](double t) {
    return ray.from.y + t * ray.along.y - ray.exaggeration * height_in(tile, {x + t * dx, z + t * dz});
  };
  double from = begin;
  double height_from = above(from);
  while (from < end) {
    auto* first = &sides[0];
    for (Crossings& side : sides) {
      if (side.next() < first->next()) first = &side;
    }
    const double to = std::clamp(first->next(), from, end);
    first->pass();
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

std::optional<Vec3> Ground::hit(Vec3 eye, Vec3 direction, double exaggeration, const WorldBounds& shown) {
  if (!whole_.stored) return std::nullopt;
  const TileGrid& grid = source_.grid();
  const Ray ray{eye, normalised(direction), exaggeration};
  const double slack = 1e-9 * (1.0 + std::abs(whole_.high) + std::abs(whole_.low)) * exaggeration;
  double begin = 0.0;
  double end = kNever;
  cut(eye.x, ray.along.x, std::max(shown.x0, 0.0), std::min(shown.x1, grid.world_width()), begin, end);
  cut(eye.z, ray.along.z, std::max(shown.z0, 0.0), std::min(shown.z1, grid.world_height()), begin, end);
  cut(eye.y, ray.along.y, whole_.low * exaggeration - slack, whole_.high * exaggeration + slack, begin, end);
  if (!(begin <= end) || end == kNever) return std::nullopt;
  const auto at = [&](double t) { return ray.from + t * ray.along; };
  Crossings columns(eye.x, ray.along.x, grid.extent_x(), begin);
  Crossings rows(eye.z, ray.along.z, grid.extent_z(), begin);
  for (double from = begin; from <= end;) {
    const bool column_first = columns.next() < rows.next();
    const double to = std::clamp(column_first ? columns.next() : rows.next(), from, end);
    column_first ? columns.pass() : rows.pass();
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
