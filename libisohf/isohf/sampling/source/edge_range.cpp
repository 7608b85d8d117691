#include "isohf/sampling/source/edge_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/base/assert.h"
#include "isohf/base/sample.h"

namespace isohf {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr ElevationRange kNothing{kInfinity, -kInfinity};

/// Codes are for the source, not for what lies beyond: an eighth of its range is given at either end.
constexpr double kMostWidening = 0.125;

void include(ElevationRange& range, float height) {
  if (std::isnan(height)) return;
  range.min = std::min(range.min, double{height});
  range.max = std::max(range.max, double{height});
}

}  // namespace

EdgeRange::EdgeRange(const SourceInfo& info, std::int64_t depth_columns, std::int64_t depth_rows)
    : info_(info),
      depth_columns_(static_cast<std::size_t>(std::min(depth_columns + 2, info.width))),
      depth_rows_(static_cast<std::size_t>(std::min(depth_rows + 2, info.height))),
      sides_{Side{0, static_cast<std::int64_t>(depth_columns_), 0},
             Side{info.width - static_cast<std::int64_t>(depth_columns_), info.width, info.width - 1}},
      bound_(kNothing) {}

EdgeRange::Profile EdgeRange::profile_of(std::span<const float> from_edge) {
  Profile profile{kNothing, kNothing};
  include(profile.edge, from_edge.front());
  for (const float height : from_edge) include(profile.inside, height);
  return profile;
}

void EdgeRange::add_between(const Profile& a, const Profile& b, ElevationRange& bound) {
  const double edge_max = std::max(a.edge.max, b.edge.max);
  const double edge_min = std::min(a.edge.min, b.edge.min);
  const double inside_max = std::max(a.inside.max, b.inside.max);
  const double inside_min = std::min(a.inside.min, b.inside.min);
  if (edge_min > edge_max) return;  // void
  bound.max = std::max(bound.max, 2.0 * edge_max - inside_min);
  bound.min = std::min(bound.min, 2.0 * edge_min - inside_max);
}

void EdgeRange::add_side(const Window& window, std::span<const std::byte> raw, Side& side) {
  const std::int64_t first = std::max(window.column, side.first);
  const std::int64_t end = std::min(window.column + window.columns, side.end);
  if (first >= end) return;
  if (first == side.first) side.rows.assign(static_cast<std::size_t>(window.rows), {kNothing, kNothing});
  const std::size_t bytes = size_bytes(info_.sample_type);
  heights_.resize(static_cast<std::size_t>(end - first));
  for (std::int64_t i = 0; i < window.rows; ++i) {
    const auto at = static_cast<std::size_t>(i * window.columns + first - window.column);
    heights_from_samples(info_, 0.0, raw.subspan(at * bytes, heights_.size() * bytes), heights_);
    Profile& profile = side.rows[static_cast<std::size_t>(i)];
    for (const float height : heights_) include(profile.inside, height);
    if (side.edge >= first && side.edge < end)
      include(profile.edge, heights_[static_cast<std::size_t>(side.edge - first)]);
  }
  if (end < side.end) return;
  for (const Profile& profile : side.rows) {
    add_between(profile, side.before.value_or(profile), bound_);
    side.before = profile;
  }
}

void EdgeRange::add_window(const Window& window, std::span<const std::byte> raw) {
  const std::size_t bytes = size_bytes(info_.sample_type);
  const auto columns = static_cast<std::size_t>(window.columns);
  const auto width = static_cast<std::size_t>(info_.width);
  ISOHF_ASSERT(raw.size() == static_cast<std::size_t>(window.rows) * columns * bytes);
  // Only the ends of most rows are converted.
  for (Side& side : sides_) add_side(window, raw, side);
  for (std::int64_t i = 0; i < window.rows; ++i) {
    const auto row = raw.subspan(static_cast<std::size_t>(i) * columns * bytes, columns * bytes);
    const auto from_north = static_cast<std::size_t>(window.row + i);
    const auto from_south = static_cast<std::size_t>(info_.height - 1 - window.row - i);
    const auto keep = [&](std::vector<float>& rows, std::size_t from_edge) {
      if (from_edge >= depth_rows_) return;
      rows.resize(depth_rows_ * width);
      heights_from_samples(
          info_, 0.0, row,
          std::span(rows).subspan(from_edge * width + static_cast<std::size_t>(window.column), columns));
    };
    keep(north_, from_north);
    keep(south_, from_south);
  }
}

void EdgeRange::add_edge_rows(const std::vector<float>& rows, ElevationRange& bound) const {
  const auto width = static_cast<std::size_t>(info_.width);
  std::vector<float> column(depth_rows_);
  Profile before{};
  for (std::size_t c = 0; c < width; ++c) {
    for (std::size_t r = 0; r < depth_rows_; ++r) column[r] = rows[r * width + c];
    const Profile profile = profile_of(column);
    add_between(profile, c == 0 ? profile : before, bound);
    before = profile;
  }
  // Corners are continued along both axes: 2(2a - b) - (2c - d) of four values in the corner's block.
  for (const bool east : {false, true}) {
    ElevationRange block = kNothing;
    for (std::size_t r = 0; r < depth_rows_; ++r) {
      for (std::size_t i = 0; i < depth_columns_; ++i) include(block, rows[r * width + (east ? width - 1 - i : i)]);
    }
    if (block.min > block.max) continue;
    bound.max = std::max(bound.max, 5.0 * block.max - 4.0 * block.min);
    bound.min = std::min(bound.min, 5.0 * block.min - 4.0 * block.max);
  }
}

ElevationRange EdgeRange::bound() const {
  ElevationRange bound = bound_;
  if (!north_.empty()) add_edge_rows(north_, bound);
  if (!south_.empty()) add_edge_rows(south_, bound);
  return bound;
}

ElevationRange EdgeRange::widen(const ElevationRange& range, const ElevationRange& bound) {
  // Heights were rounded to single precision.
  const double slack = 1e-6 * std::max(std::abs(range.min), std::abs(range.max));
  const double most = (range.max - range.min) * kMostWidening;
  ElevationRange wide = range;
  if (bound.max > range.max) wide.max = std::min(bound.max + slack, range.max + most);
  if (bound.min < range.min) wide.min = std::max(bound.min - slack, range.min - most);
  return wide;
}

}  // namespace isohf
