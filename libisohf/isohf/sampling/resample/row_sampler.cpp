#include "isohf/sampling/resample/row_sampler.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "isohf/base/assert.h"
#include "isohf/base/simd.h"
#include "isohf/sampling/resample/void_rule.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

ISOHF_KERNEL void weigh(const float* __restrict in, float weight, std::int64_t count, float* __restrict out) {
  for (std::int64_t k = 0; k < count; ++k) out[k] = weight * in[k];
}
ISOHF_KERNEL void add_weighted(const float* __restrict in, float weight, std::int64_t count, float* __restrict out) {
  for (std::int64_t k = 0; k < count; ++k) out[k] += weight * in[k];
}

/// The weights of four rows at once, as weigh() and add_weighted() would one after the other.
ISOHF_KERNEL void weigh_four(const std::array<const float*, 4>& in, const float* weights, std::int64_t count,
                             float* __restrict out) {
  const float* __restrict a = in[0];
  const float* __restrict b = in[1];
  const float* __restrict c = in[2];
  const float* __restrict d = in[3];
  for (std::int64_t k = 0; k < count; ++k) {
    out[k] = weights[0] * a[k] + weights[1] * b[k] + weights[2] * c[k] + weights[3] * d[k];
  }
}

/// line[k] = sum over the row taps of weight * band(column first + k), continued at the source's ends.
void blend_rows(const SourceBand& band, const TapWeights& rows, const Kernel& kernel, const SourceAxis& axis_x,
                const SourceAxis& axis_z, const ColumnTaps& columns, std::span<float> line) {
  const std::int64_t inner_first = std::clamp<std::int64_t>(columns.first, 0, axis_x.samples());
  const std::int64_t inner_last =
      std::clamp<std::int64_t>(columns.first + columns.width, inner_first, axis_x.samples());
  const std::int64_t inner = inner_last - inner_first;
  float* out = line.data() + (inner_first - columns.first);
  const auto row_at = [&](std::int64_t row) { return band.heights.row(row - band.first_row); };
  bool is_first = true;
  const auto add_row = [&](std::int64_t row, float weight, bool is_inner_done) {
    const float* source = row_at(row);
    const float* in = source + (inner_first - band.first_column);
    if (!is_inner_done)
      is_first ? vectorised<weigh>(in, weight, inner, out) : vectorised<add_weighted>(in, weight, inner, out);
    const auto beyond = [&](std::int64_t k) {
      float height = 0.0F;
      axis_x.stand_ins(columns.first + k, [&](std::int64_t column, int share) {
        height += static_cast<float>(share) * source[column - band.first_column];
      });
      float& place = line[static_cast<std::size_t>(k)];
      place = is_first ? weight * height : place + weight * height;
    };
    for (std::int64_t k = 0; k < inner_first - columns.first; ++k) beyond(k);
    for (std::int64_t k = inner_last - columns.first; k < columns.width; ++k) beyond(k);
    is_first = false;
  };
  const bool is_inside = rows.first >= 0 && rows.first + kernel.taps() <= axis_z.samples();
  const bool at_once = is_inside && kernel.taps() == 4;
  if (at_once) {
    const std::int64_t left = inner_first - band.first_column;
    const auto row = [&](int t) { return row_at(rows.first + t) + left; };
    vectorised<weigh_four>(std::array{row(0), row(1), row(2), row(3)}, rows.weights.data(), inner, out);
  }
  for (int t = 0; t < kernel.taps(); ++t) {
    const float weight = rows.weights[static_cast<std::size_t>(t)];
    axis_z.stand_ins(rows.first + t,
                     [&](std::int64_t row, int share) { add_row(row, static_cast<float>(share) * weight, at_once); });
  }
}

ISOHF_KERNEL void range_of_two(const float* __restrict a, const float* __restrict b, std::int64_t count,
                               float* __restrict least, float* __restrict most) {
  for (std::int64_t k = 0; k < count; ++k) {
    least[k] = a[k] < b[k] ? a[k] : b[k];
    most[k] = a[k] < b[k] ? b[k] : a[k];
  }
}
ISOHF_KERNEL void widen_to_next(std::int64_t count, float* __restrict least, float* __restrict most) {
  for (std::int64_t k = 0; k + 1 < count; ++k) {
    least[k] = least[k + 1] < least[k] ? least[k + 1] : least[k];
    most[k] = most[k + 1] > most[k] ? most[k + 1] : most[k];
  }
}

/// The range of the four samples around a place between columns first + k and first + k + 1, and between the middle
/// two of the rows. Mirrored at the source's ends: no other sample is there.
void cell_ranges(const SourceBand& band, const TapWeights& rows, const SourceAxis& axis_x, const SourceAxis& axis_z,
                 const ColumnTaps& columns, std::vector<float>& least, std::vector<float>& most) {
  least.resize(static_cast<std::size_t>(columns.width));
  most.resize(least.size());
  const float* above = band.heights.row(axis_z.index(rows.first + 1) - band.first_row);
  const float* below = band.heights.row(axis_z.index(rows.first + 2) - band.first_row);
  const auto add = [&](std::int64_t column, std::int64_t count, std::int64_t k) {
    const std::int64_t at = column - band.first_column;
    vectorised<range_of_two>(above + at, below + at, count, least.data() + k, most.data() + k);
  };
  const std::int64_t inner_first = std::clamp<std::int64_t>(columns.first, 0, axis_x.samples());
  const std::int64_t inner_last =
      std::clamp<std::int64_t>(columns.first + columns.width, inner_first, axis_x.samples());
  add(inner_first, inner_last - inner_first, inner_first - columns.first);
  for (std::int64_t k = 0; k < inner_first - columns.first; ++k) add(axis_x.index(columns.first + k), 1, k);
  for (std::int64_t k = inner_last - columns.first; k < columns.width; ++k) add(axis_x.index(columns.first + k), 1, k);
  vectorised<widen_to_next>(columns.width, least.data(), most.data());
}

/// Rule 6 of kernels.h; a NaN stays.
ISOHF_KERNEL void hold_within_cells(const ColumnTaps& columns, const float* __restrict least,
                                    const float* __restrict most, float* __restrict values) {
  const std::int32_t* __restrict start = columns.start.data();
  for (std::size_t c = 0; c < columns.count; ++c) {
    values[c] = held_within(values[c], least[start[c] + 1], most[start[c] + 1]);
  }
}

/// near_void[c] = 1 where a tap of column c, on one of the rows that `rows` read, is a void. line as in blend_rows.
void find_voids(const SourceBand& band, const TapWeights& rows, int taps, const SourceAxis& axis_x,
                const SourceAxis& axis_z, const ColumnTaps& columns, std::span<char> line, std::span<char> near_void) {
  std::fill(line.begin(), line.end(), char{0});
  bool any = false;
  for (int t = 0; t < taps; ++t) {
    const char* row = band.voids.row(axis_z.index(rows.first + t) - band.first_row);
    for (std::int64_t k = 0; k < columns.width; ++k) {
      const char is_void = row[axis_x.index(columns.first + k) - band.first_column];
      line[static_cast<std::size_t>(k)] |= is_void;
      any |= is_void != 0;
    }
  }
  std::fill(near_void.begin(), near_void.end(), char{0});
  if (!any) return;
  for (std::size_t c = 0; c < near_void.size(); ++c) {
    for (int t = 0; t < taps; ++t) near_void[c] |= line[static_cast<std::size_t>(columns.start[c] + t)];
  }
}

template <int kTaps>
ISOHF_KERNEL void gather_columns(const ColumnTaps& columns, const float* __restrict line, float* __restrict out) {
  const std::size_t count = columns.count;
  const std::int32_t* __restrict start = columns.start.data();
  const float* __restrict weights = columns.weights.data();
  for (std::size_t c = 0; c < count; ++c) {
    const float* from = line + start[c];
    float height = weights[c] * from[0];
    for (int t = 1; t < kTaps; ++t) height += weights[static_cast<std::size_t>(t) * count + c] * from[t];
    out[c] = height;
  }
}

ISOHF_KERNEL bool has_nan(const float* values, std::size_t count) {
  std::int32_t any = 0;
  for (std::size_t i = 0; i < count; ++i) any |= values[i] != values[i] ? 1 : 0;
  return any != 0;
}

void gather_columns(int taps, const ColumnTaps& columns, const float* line, float* out) {
  switch (taps) {
    case 1:
      return vectorised<gather_columns<1>>(columns, line, out);
    case 2:
      return vectorised<gather_columns<2>>(columns, line, out);
    case 4:
      return vectorised<gather_columns<4>>(columns, line, out);
    default:
      ISOHF_ASSERT(false);
  }
}

}  // namespace

ColumnTaps make_column_taps(const SourceAxis& axis, const Kernel& kernel, std::span<const double> world_x) {
  const std::size_t columns = world_x.size();
  ColumnTaps taps;
  taps.position.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) {
    const SourceAxis::Place place = axis.place(world_x[c]);
    taps.position[c] = place.position;
    if (!place.continued) continue;
    taps.continued.push_back(c);
    taps.edge.push_back(place.edge == 0.0 ? columns : columns + 1);
  }
  // The edges are read only where something is continued; elsewhere they would stretch the line over the whole source.
  const auto edge_or_column = [&](std::size_t edge_place, double edge) {
    const bool is_read = std::find(taps.edge.begin(), taps.edge.end(), edge_place) != taps.edge.end();
    return is_read ? edge : taps.position[0];
  };
  taps.position.push_back(edge_or_column(columns, 0.0));
  taps.position.push_back(edge_or_column(columns + 1, static_cast<double>(axis.samples() - 1)));

  taps.count = taps.position.size();
  taps.weights.resize(taps.count * static_cast<std::size_t>(kernel.taps()));
  std::vector<std::int64_t> first(taps.count);
  for (std::size_t i = 0; i < taps.count; ++i) {
    const TapWeights at = kernel.at(taps.position[i]);
    first[i] = at.first;
    for (int t = 0; t < kernel.taps(); ++t) {
      taps.weights[static_cast<std::size_t>(t) * taps.count + i] = at.weights[static_cast<std::size_t>(t)];
    }
  }
  if (axis.wraps()) {
    // Whole turns away from the others, a tap would stretch the line all the way round.
    const std::int64_t round = axis.samples();
    for (std::int64_t& tap : first) {
      const std::int64_t turned = tap - first.front() + round / 2;
      const std::int64_t within = ((turned % round) + round) % round;
      tap = first.front() + within - round / 2;
    }
  }
  const auto [low, high] = std::minmax_element(first.begin(), first.end());
  taps.first = *low;
  taps.width = *high - *low + kernel.taps();
  for (const std::int64_t tap : first) taps.start.push_back(static_cast<std::int32_t>(tap - taps.first));
  return taps;
}

void add_columns_needed(const SourceAxis& axis, const ColumnTaps& taps, std::int64_t reach, RowRange& range) {
  const std::int64_t last = axis.samples() - 1;
  const auto add = [&](std::int64_t column) {
    range.first = std::min(range.first, column);
    range.last = std::max(range.last, column);
  };
  add(std::clamp<std::int64_t>(taps.first - reach, 0, last));
  add(std::clamp<std::int64_t>(taps.first + taps.width - 1 + reach, 0, last));
  for (std::int64_t k = taps.first; k < 0; ++k) add(axis.index(k));
  for (std::int64_t k = last + 1; k < taps.first + taps.width; ++k) add(axis.index(k));
}

RowSampler::RowSampler(const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel,
                       const ElevationRange& limits, const LatticeAround& around)
    : axis_x_(axis_x),
      axis_z_(axis_z),
      kernel_(kernel),
      around_(around),
      lowest_(static_cast<float>(limits.min)),
      highest_(static_cast<float>(limits.max)) {
  around_.lowest = lowest_;
  around_.highest = highest_;
}

void RowSampler::add_rows_needed(double world_z, RowRange& range) const {
  const auto add = [&](double v) {
    const std::int64_t first = kernel_.at(v).first;
    for (std::int64_t row = first; row < first + kernel_.taps(); ++row) {
      const std::int64_t mirrored = axis_z_.index(row);
      range.first = std::min(range.first, mirrored);
      range.last = std::max(range.last, mirrored);
    }
    const std::int64_t reach = around_.reach_z > kernel_.taps() / 2 ? around_.reach_z : 0;
    range.first = std::min(range.first, std::clamp<std::int64_t>(first - reach, 0, axis_z_.samples() - 1));
    range.last =
        std::max(range.last, std::clamp<std::int64_t>(first + kernel_.taps() - 1 + reach, 0, axis_z_.samples() - 1));
  };
  const SourceAxis::Place place = axis_z_.place(world_z);
  add(place.position);
  if (place.continued) add(place.edge);
}

void RowSampler::sample_at(const SourceBand& band, double v, const ColumnTaps& columns, Scratch& scratch,
                           std::vector<float>& values) const {
  const TapWeights rows = kernel_.at(v);
  scratch.line.resize(static_cast<std::size_t>(columns.width));
  blend_rows(band, rows, kernel_, axis_x_, axis_z_, columns, scratch.line);
  values.resize(columns.count);
  gather_columns(kernel_.taps(), columns, scratch.line.data(), values.data());
  if (kernel_.is_limited()) {
    cell_ranges(band, rows, axis_x_, axis_z_, columns, scratch.least, scratch.most);
    vectorised<hold_within_cells>(columns, scratch.least.data(), scratch.most.data(), values.data());
  }
  if (band.voids.data() != nullptr || vectorised<has_nan>(values.data(), values.size()))
    resample_near_voids(band, v, columns, rows, scratch, values);
  for (std::size_t i = 0; i < columns.continued.size(); ++i) {
    float& value = values[columns.continued[i]];
    value = continue_slope(values[columns.edge[i]], value);
  }
}

void RowSampler::resample_near_voids(const SourceBand& band, double v, const ColumnTaps& columns,
                                     const TapWeights& rows, Scratch& scratch, std::vector<float>& values) const {
  scratch.near_void.assign(columns.count, 0);
  if (band.voids.data() != nullptr) {
    scratch.void_line.resize(scratch.line.size());
    find_voids(band, rows, kernel_.taps(), axis_x_, axis_z_, columns, scratch.void_line, scratch.near_void);
  }
  const VoidRule rule(band, axis_x_, axis_z_, kernel_, around_);
  for (std::size_t c = 0; c < values.size(); ++c) {
    if (!std::isnan(values[c]) && scratch.near_void[c] == 0) continue;
    TapWeights taps{columns.first + columns.start[c], {}};
    for (std::size_t t = 0; t < static_cast<std::size_t>(kernel_.taps()); ++t) {
      taps.weights[t] = columns.weights[t * columns.count + c];
    }
    values[c] = rule.at(columns.position[c], v, taps, rows);
  }
}

void RowSampler::sample(const SourceBand& band, double world_z, const ColumnTaps& columns, Scratch& scratch,
                        std::span<float> heights) const {
  ISOHF_ASSERT(heights.size() + 2 == columns.count);
  const SourceAxis::Place place = axis_z_.place(world_z);
  std::vector<float>& values = scratch.values;
  sample_at(band, place.position, columns, scratch, values);
  if (place.continued) {
    sample_at(band, place.edge, columns, scratch, scratch.edge_values);
    for (std::size_t c = 0; c < heights.size(); ++c) values[c] = continue_slope(scratch.edge_values[c], values[c]);
  }
  if (place.continued) {
    for (std::size_t c = 0; c < heights.size(); ++c) values[c] = held_within(values[c], lowest_, highest_);
  }
  for (const std::size_t c : columns.continued) values[c] = held_within(values[c], lowest_, highest_);
  std::copy_n(values.begin(), heights.size(), heights.begin());
}

}  // namespace isohf
