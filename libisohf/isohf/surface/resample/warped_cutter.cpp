#include "isohf/surface/resample/warped_cutter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "isohf/base/assert.h"
#include "isohf/surface/resample/void_rule.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

double reach_of(const SourceAxis& x, const SourceAxis& z, Outside outside) {
  if (outside == Outside::kClamp) return HUGE_VAL;  // the edge goes on for ever
  return static_cast<double>(std::max(x.continued_samples(), z.continued_samples())) + 1.0;
}

/// Sum over taps x taps coefficients, the first of which is `from`.
template <int kTaps>
float blend(const float* from, std::int64_t stride, const TapWeights& columns, const TapWeights& rows) {
  float sum = 0.0F;
  for (int j = 0; j < kTaps; ++j) {
    const float* line = from + j * stride;
    float along = columns.weights[0] * line[0];
    for (int i = 1; i < kTaps; ++i) along += columns.weights[static_cast<std::size_t>(i)] * line[i];
    sum += rows.weights[static_cast<std::size_t>(j)] * along;
  }
  return sum;
}

float blend(int taps, const float* from, std::int64_t stride, const TapWeights& columns, const TapWeights& rows) {
  switch (taps) {
    case 1:
      return *from;
    case 2:
      return blend<2>(from, stride, columns, rows);
    case 3:
      return blend<3>(from, stride, columns, rows);
    case 4:
      return blend<4>(from, stride, columns, rows);
    case 6:
      return blend<6>(from, stride, columns, rows);
    default:
      ISOHF_ASSERT(taps == 12);
      return blend<12>(from, stride, columns, rows);
  }
}

/// Rule 5 of kernels.h: `from` as in blend, of four taps.
float held_within_cell(float height, const float* from, std::int64_t stride) {
  const float* above = from + stride + 1;
  const float* below = above + stride;
  const auto [least, most] = std::minmax({above[0], above[1], below[0], below[1]});
  return held_within(height, least, most);
}

bool any_void(const char* from, std::int64_t stride, int taps) {
  char any = 0;
  for (int j = 0; j < taps; ++j) {
    for (int i = 0; i < taps; ++i) any = static_cast<char>(any | from[j * stride + i]);
  }
  return any != 0;
}

}  // namespace

WarpedCutter::WarpedCutter(const TileGrid& grid, const WarpPlace& place, const SourceAxis& axis_x,
                           const SourceAxis& axis_z, Outside outside, const Kernel& kernel,
                           const ElevationRange& limits)
    : grid_(grid),
      axis_x_(axis_x),
      axis_z_(axis_z),
      kernel_(kernel),
      warp_(grid, place, reach_of(axis_x, axis_z, outside)),
      bounds_(warp_.reading_bounds()),
      lowest_(static_cast<float>(limits.min)),
      highest_(static_cast<float>(limits.max)) {}

RowRange WarpedCutter::rows_needed(std::int64_t tile_row) const {
  const SourceWarp::RowBounds& bounds = bounds_[static_cast<std::size_t>(tile_row)];
  const std::int64_t count = axis_z_.samples();
  RowRange range = RowRange::none();
  const auto add = [&](double v) {
    const std::int64_t first = kernel_.at(v).first;
    for (std::int64_t row = first; row < first + kernel_.taps(); ++row) {
      range.first = std::min(range.first, axis_z_.index(row));
      range.last = std::max(range.last, axis_z_.index(row));
    }
  };
  const auto last = static_cast<double>(count - 1);
  add(std::clamp(bounds.least, 0.0, last));
  add(std::clamp(bounds.most, 0.0, last));
  // What is continued reads the edge and as far inside as it lies outside.
  const auto inside = static_cast<double>(axis_z_.continued_samples());
  if (bounds.least < 0.0) add(std::min(inside, last));
  if (bounds.most > last) add(std::max(last - inside, 0.0));
  return range;
}

/// One row of vertices: memory that is used again from row to row.
struct WarpedCutter::Row {
  std::vector<TapWeights> columns;
  std::vector<TapWeights> rows;
};

float WarpedCutter::sample_inside(const SourceBand& band, double u, double v) const {
  return VoidRule(band, axis_x_, axis_z_, kernel_).at(u, v, kernel_.at(u), kernel_.at(v));
}

float WarpedCutter::sample(const SourceBand& band, double u, double v) const {
  if (std::isnan(u) || std::isnan(v)) return kVoid;
  if (!axis_x_.wraps()) {
    // Beyond half a turn from the middle the other side is nearer.
    const double middle = static_cast<double>(axis_x_.samples() - 1) / 2.0;
    u = middle + std::remainder(u - middle, warp_.exact().place().columns_round());
  }
  const SourceAxis::Place x = axis_x_.place(u);
  const SourceAxis::Place z = axis_z_.place(v);
  if (!x.has_elevation || !z.has_elevation) return kVoid;
  const auto along_row = [&](double row) {
    const float height = sample_inside(band, x.position, row);
    return x.continued ? continue_slope(sample_inside(band, x.edge, row), height) : height;
  };
  float height = along_row(z.position);
  if (z.continued) height = continue_slope(along_row(z.edge), height);
  if (x.continued || z.continued) height = held_within(height, lowest_, highest_);
  return height;
}

void WarpedCutter::sample_row(const SourceBand& band, const double* u, const double* v, Row&, float* heights) const {
  const int taps = kernel_.taps();
  const auto last_u = static_cast<double>(axis_x_.samples() - 1);
  const auto last_v = static_cast<double>(axis_z_.samples() - 1);
  const std::int64_t end_column = axis_x_.samples() - taps;
  const std::int64_t first_row = band.first_row;
  const std::int64_t end_row = band.first_row + band.heights.rows() - taps;
  const std::int64_t stride = band.heights.stride();
  for (int c = 0; c < grid_.shape().columns(); ++c) {
    heights[c] = kVoid;
    if (u[c] >= 0.0 && u[c] <= last_u && v[c] >= 0.0 && v[c] <= last_v) {
      const TapWeights columns = kernel_.at(u[c]);
      const TapWeights rows = kernel_.at(v[c]);
      // Away from the source's ends: no tap is another one's mirror image.
      if (columns.first >= 0 && columns.first <= end_column && rows.first >= 0 &&
          rows.first + taps <= axis_z_.samples()) {
        ISOHF_ASSERT(rows.first >= first_row && rows.first <= end_row);
        const std::int64_t at = (rows.first - first_row) * stride + columns.first - band.first_column;
        const bool near_void = band.voids.data() != nullptr && any_void(band.voids.data() + at, stride, taps);
        const float* from = band.heights.data() + at;
        heights[c] = near_void ? kVoid : blend(taps, from, stride, columns, rows);
        if (std::isnan(heights[c])) {
          heights[c] = VoidRule(band, axis_x_, axis_z_, kernel_).at(u[c], v[c], columns, rows);
        } else if (kernel_.is_limited()) {
          heights[c] = held_within_cell(heights[c], from, stride);
        }
        continue;
      }
    }
    heights[c] = sample(band, u[c], v[c]);
  }
}

void WarpedCutter::cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const {
  const auto columns = static_cast<std::size_t>(grid_.shape().columns());
  ISOHF_ASSERT(heights.size() == static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
  std::vector<double> u(heights.size());
  std::vector<double> v(heights.size());
  warp_.positions(tile, u, v);
  Row row;
  for (std::size_t at = 0; at < heights.size(); at += columns) {
    sample_row(band, u.data() + at, v.data() + at, row, heights.data() + at);
  }
}

}  // namespace isohf
