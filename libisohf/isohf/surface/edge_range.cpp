#include "isohf/surface/edge_range.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/surface/height_source.h"

namespace isohf {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

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
      bound_{kInfinity, -kInfinity} {}

EdgeRange::Profile EdgeRange::profile_of(std::span<const float> from_edge) {
  Profile profile{{kInfinity, -kInfinity}, {kInfinity, -kInfinity}};
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

void EdgeRange::add_row_profiles(std::span<const float> row) {
  std::vector<float> east(row.end() - static_cast<std::ptrdiff_t>(depth_columns_), row.end());
  std::reverse(east.begin(), east.end());
  const std::vector<Profile> profiles = {profile_of(row.first(depth_columns_)), profile_of(east)};
  const std::vector<Profile>& before = last_profiles_.empty() ? profiles : last_profiles_;
  for (std::size_t i = 0; i < 2; ++i) add_between(profiles[i], before[i], bound_);
  last_profiles_ = profiles;
}

void EdgeRange::add_rows(std::span<const std::byte> raw) {
  const std::size_t bytes = size_bytes(info_.sample_type);
  const auto width = static_cast<std::size_t>(info_.width);
  const auto rows = static_cast<std::int64_t>(raw.size() / (width * bytes));
  std::vector<float> sides(2 * depth_columns_);
  for (std::int64_t i = 0; i < rows; ++i, ++rows_) {
    const auto row = raw.subspan(static_cast<std::size_t>(i) * width * bytes, width * bytes);
    // Only the ends of most rows are converted.
    heights_from_samples(info_, 0.0, row.first(depth_columns_ * bytes), std::span(sides).first(depth_columns_));
    heights_from_samples(info_, 0.0, row.last(depth_columns_ * bytes), std::span(sides).last(depth_columns_));
    add_row_profiles(sides);
    const bool is_first = rows_ < static_cast<std::int64_t>(depth_rows_);
    const bool is_last = rows_ >= info_.height - static_cast<std::int64_t>(depth_rows_);
    if (!is_first && !is_last) continue;
    std::vector<float> heights(width);
    heights_from_samples(info_, 0.0, row, heights);
    if (is_first) first_rows_.push_back(heights);
    if (is_last) last_rows_.push_front(std::move(heights));
  }
}

void EdgeRange::add_edge_rows(bool from_end, ElevationRange& bound) const {
  const std::deque<std::vector<float>>& rows = from_end ? last_rows_ : first_rows_;
  if (rows.empty()) return;
  std::vector<float> column(rows.size());
  Profile before{};
  for (std::size_t c = 0; c < static_cast<std::size_t>(info_.width); ++c) {
    for (std::size_t r = 0; r < rows.size(); ++r) column[r] = rows[r][c];
    const Profile profile = profile_of(column);
    add_between(profile, c == 0 ? profile : before, bound);
    before = profile;
  }
  // Corners are continued along both axes: 2(2a - b) - (2c - d) of four values in the corner's block.
  for (const bool east : {false, true}) {
    ElevationRange block{kInfinity, -kInfinity};
    for (const std::vector<float>& row : rows) {
      for (std::size_t i = 0; i < depth_columns_; ++i) include(block, row[east ? row.size() - 1 - i : i]);
    }
    if (block.min > block.max) continue;
    bound.max = std::max(bound.max, 5.0 * block.max - 4.0 * block.min);
    bound.min = std::min(bound.min, 5.0 * block.min - 4.0 * block.max);
  }
}

ElevationRange EdgeRange::widen(const ElevationRange& range) const {
  ElevationRange bound = bound_;
  add_edge_rows(false, bound);
  add_edge_rows(true, bound);
  // Heights were rounded to single precision.
  const double slack = 1e-6 * std::max(std::abs(range.min), std::abs(range.max));
  const double most = (range.max - range.min) * kMostWidening;
  ElevationRange wide = range;
  if (bound.max > range.max) wide.max = std::min(bound.max + slack, range.max + most);
  if (bound.min < range.min) wide.min = std::max(bound.min - slack, range.min - most);
  return wide;
}

}  // namespace isohf
