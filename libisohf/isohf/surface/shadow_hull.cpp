#include "isohf/surface/shadow_hull.h"

#include <algorithm>
#include <cmath>

#include "isohf/surface/shadow.h"

namespace isohf {
namespace {

/// One row's own casters; `is_void(sample)` says which samples are none.
template <typename Sample, typename IsVoid>
CasterRows casters_of(const TileShape& shape, View2D<const Sample> samples, LightTravel travel, double fall_min,
                      IsVoid is_void) {
  CasterRows rows;
  rows.starts.reserve(static_cast<std::size_t>(visible_rows(shape)) + 1);
  rows.starts.push_back(0);
  ShadowHull hull(fall_min);
  const int across = half_steps_across(shape);
  for (int row = 1; row <= visible_rows(shape); ++row) {
    hull.clear();
    const int last = last_visible_column(shape, row);
    for (int i = 1; i <= last; ++i) {
      const int column = travel == LightTravel::kEastward ? i : last + 1 - i;
      const Sample sample = samples(column, row);
      if (is_void(sample)) continue;
      const int x = object_x(shape.columns(), column, row);
      hull.push(travel == LightTravel::kEastward ? x : across - x, static_cast<double>(sample));
    }
    // Seen from one half step behind the edge, so that the vertex on the edge is listed.
    const std::size_t first = rows.casters.size();
    hull.casters_at(across + 1, rows.casters);
    for (std::size_t k = first; k < rows.casters.size(); ++k) --rows.casters[k].distance;
    rows.starts.push_back(static_cast<std::uint32_t>(rows.casters.size()));
  }
  return rows;
}

}  // namespace

void ShadowHull::push(std::int64_t position, double height) {
  // Overtopped at fall_min, hence at every larger fall. What lies deeper is not: the hull rises faster than fall_min.
  while (!points_.empty() &&
         points_.back().height - height <= static_cast<double>(position - points_.back().position) * fall_min_) {
    points_.pop_back();
  }
  while (points_.size() >= 2) {
    const Point& near = points_.back();
    const Point& far = points_[points_.size() - 2];
    const double rise = near.height - height;
    const double run = static_cast<double>(position - near.position);
    const double rise_beyond = far.height - near.height;
    const double run_beyond = static_cast<double>(near.position - far.position);
    if (rise * run_beyond > rise_beyond * run) break;
    points_.pop_back();
  }
  points_.push_back({position, height});
}

void ShadowHull::casters_at(std::int64_t position, std::vector<ShadowCaster>& out) const {
  for (std::size_t i = points_.size(); i-- > 0;) {
    if (points_[i].position != position) out.push_back({position - points_[i].position, points_[i].height});
  }
}

CasterRows tile_casters(const TileShape& shape, View2D<const std::uint16_t> codes, std::uint16_t void_code,
                        LightTravel travel, double fall_min) {
  return casters_of(shape, codes, travel, fall_min, [void_code](std::uint16_t code) { return code == void_code; });
}

CasterRows tile_casters(const TileShape& shape, View2D<const float> heights, LightTravel travel, double fall_min) {
  return casters_of(shape, heights, travel, fall_min, [](float height) { return !std::isfinite(height); });
}

CasterRows pass_on_casters(const TileShape& shape, const CasterRows& entering, const CasterRows& own, double fall_min,
                           double lowest) {
  CasterRows out;
  out.starts.reserve(static_cast<std::size_t>(visible_rows(shape)) + 1);
  out.starts.push_back(0);
  const std::int64_t across = half_steps_across(shape);
  ShadowHull hull(fall_min);
  for (int row = 1; row <= visible_rows(shape); ++row) {
    hull.clear();
    // Positions count from the edge where the light enters, farthest first.
    const auto before = entering.row(row);
    for (auto caster = before.rbegin(); caster != before.rend(); ++caster) hull.push(-caster->distance, caster->height);
    const auto inside = own.row(row);
    for (auto caster = inside.rbegin(); caster != inside.rend(); ++caster) {
      hull.push(across - caster->distance, caster->height);
    }
    const std::size_t first = out.casters.size();
    hull.casters_at(across, out.casters);
    // The farthest caster is the highest at fall_min: where its shadow reaches nothing, none does.
    if (out.casters.size() > first) {
      const ShadowCaster& farthest = out.casters.back();
      if (farthest.height - static_cast<double>(farthest.distance) * fall_min <= lowest) out.casters.resize(first);
    }
    out.starts.push_back(static_cast<std::uint32_t>(out.casters.size()));
  }
  return out;
}

CasterRows no_casters(const TileShape& shape) {
  CasterRows none;
  none.starts.assign(static_cast<std::size_t>(visible_rows(shape)) + 1, 0);
  return none;
}

double shadow_height_from(std::span<const ShadowCaster> casters, double fall) {
  double height = kNoShadow;
  for (const ShadowCaster& caster : casters) {
    height = std::max(height, caster.height - static_cast<double>(caster.distance) * fall);
  }
  return height;
}

}  // namespace isohf
