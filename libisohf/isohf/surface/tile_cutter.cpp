#include "isohf/surface/tile_cutter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr float kVoid = std::numeric_limits<float>::quiet_NaN();

/// Taps of all columns of one row parity. The line they read holds `width` coefficients, from unmirrored source column
/// `first` on.
struct ColumnTaps {
  std::vector<std::int32_t> start;  ///< [C] first tap's place in the line
  std::vector<float> weights;       ///< [taps][C]
  std::vector<char> outside;        ///< [C] 1 where Outside::kVoid leaves no elevation
  std::vector<double> position;     ///< [C] in source columns
  std::int64_t first = 0;
  std::int64_t width = 0;
  bool any_outside = false;
};

ColumnTaps make_column_taps(const TileGrid& grid, const SourceAxis& axis, const Kernel& kernel, TileIndex tile,
                            int parity) {
  const int columns = grid.shape().columns();
  const auto count = static_cast<std::size_t>(columns);
  ColumnTaps taps;
  taps.start.resize(count);
  taps.weights.resize(count * static_cast<std::size_t>(kernel.taps()));
  taps.outside.assign(count, 0);
  taps.position.resize(count);
  std::vector<std::int64_t> first(count);
  std::int64_t low = std::numeric_limits<std::int64_t>::max();
  std::int64_t high = std::numeric_limits<std::int64_t>::min();
  for (int c = 0; c < columns; ++c) {
    const auto i = static_cast<std::size_t>(c);
    const double world = grid.world_from_lattice(grid.lattice_vertex(tile, {c, parity})).x;
    taps.outside[i] = axis.has_elevation(world) ? 0 : 1;
    taps.any_outside |= taps.outside[i] != 0;
    taps.position[i] = axis.position(world);
    const TapWeights at = kernel.at(taps.position[i]);
    first[i] = at.first;
    low = std::min(low, at.first);
    high = std::max(high, at.first + kernel.taps() - 1);
    for (int t = 0; t < kernel.taps(); ++t) {
      taps.weights[static_cast<std::size_t>(t) * count + i] = at.weights[static_cast<std::size_t>(t)];
    }
  }
  taps.first = low;
  taps.width = high - low + 1;
  for (std::size_t i = 0; i < count; ++i) taps.start[i] = static_cast<std::int32_t>(first[i] - low);
  return taps;
}

/// line[k] = sum over the row taps of weight * band(column first + k), mirrored at the source's ends.
void blend_rows(const SourceBand& band, const TapWeights& rows, int taps, const SourceAxis& axis_x,
                const SourceAxis& axis_z, const ColumnTaps& columns, std::span<float> line) {
  const std::int64_t inner_first = std::clamp<std::int64_t>(columns.first, 0, axis_x.samples());
  const std::int64_t inner_last =
      std::clamp<std::int64_t>(columns.first + columns.width, inner_first, axis_x.samples());
  for (int t = 0; t < taps; ++t) {
    const float weight = rows.weights[static_cast<std::size_t>(t)];
    const float* source = band.heights.row(mirror_index(rows.first + t, axis_z.samples()) - band.first_row);
    float* out = line.data() + (inner_first - columns.first);
    const float* in = source + inner_first;
    const std::int64_t inner = inner_last - inner_first;
    if (t == 0) {
      for (std::int64_t k = 0; k < inner; ++k) out[k] = weight * in[k];
    } else {
      for (std::int64_t k = 0; k < inner; ++k) out[k] += weight * in[k];
    }
    const auto mirrored = [&](std::int64_t k) {
      const float height = weight * source[mirror_index(columns.first + k, axis_x.samples())];
      line[static_cast<std::size_t>(k)] = t == 0 ? height : line[static_cast<std::size_t>(k)] + height;
    };
    for (std::int64_t k = 0; k < inner_first - columns.first; ++k) mirrored(k);
    for (std::int64_t k = inner_last - columns.first; k < columns.width; ++k) mirrored(k);
  }
}

/// near_void[c] = 1 where a tap of column c, on one of the rows that `rows` read, is a void. line as in blend_rows.
void find_voids(const SourceBand& band, const TapWeights& rows, int taps, const SourceAxis& axis_x,
                const SourceAxis& axis_z, const ColumnTaps& columns, std::span<char> line, std::span<char> near_void) {
  std::fill(line.begin(), line.end(), char{0});
  bool any = false;
  for (int t = 0; t < taps; ++t) {
    const char* row = band.voids.row(mirror_index(rows.first + t, axis_z.samples()) - band.first_row);
    for (std::int64_t k = 0; k < columns.width; ++k) {
      const char is_void = row[mirror_index(columns.first + k, axis_x.samples())];
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
void gather_columns(const ColumnTaps& columns, const float* line, std::span<float> out) {
  const std::size_t count = out.size();
  const std::int32_t* start = columns.start.data();
  const float* weights = columns.weights.data();
  for (std::size_t c = 0; c < count; ++c) {
    const float* from = line + start[c];
    float height = weights[c] * from[0];
    for (int t = 1; t < kTaps; ++t) height += weights[static_cast<std::size_t>(t) * count + c] * from[t];
    out[c] = height;
  }
}

void gather_columns(int taps, const ColumnTaps& columns, const float* line, std::span<float> out) {
  switch (taps) {
    case 1:
      return gather_columns<1>(columns, line, out);
    case 2:
      return gather_columns<2>(columns, line, out);
    case 3:
      return gather_columns<3>(columns, line, out);
    case 4:
      return gather_columns<4>(columns, line, out);
    case 6:
      return gather_columns<6>(columns, line, out);
    case 12:
      return gather_columns<12>(columns, line, out);
    default:
      ISOHF_ASSERT(false);
  }
}

/// One vertex with a void among its taps, by the rule in kernels.h.
class VoidAwareSampler {
 public:
  VoidAwareSampler(const SourceBand& band, const SourceAxis& axis_x, const SourceAxis& axis_z, int taps)
      : band_(band), axis_x_(axis_x), axis_z_(axis_z), taps_(taps) {}

  [[nodiscard]] float at(double u, double v, const ColumnTaps& columns, std::size_t c, const TapWeights& rows) const {
    if (all_nearest_void(u, v)) return kVoid;
    double sum = 0.0;
    double weight_sum = 0.0;
    double valid_weight = 0.0;
    bool whole = true;
    const std::int64_t first_column = columns.first + columns.start[c];
    for (int j = 0; j < taps_; ++j) {
      for (int i = 0; i < taps_; ++i) {
        const double weight = double{columns.weights[static_cast<std::size_t>(i) * columns.start.size() + c]} *
                              rows.weights[static_cast<std::size_t>(j)];
        if (!is_void(first_column + i, rows.first + j)) valid_weight += weight;
        const float height = coefficient(first_column + i, rows.first + j);
        if (std::isnan(height)) {
          whole = false;
          continue;
        }
        sum += weight * height;
        weight_sum += weight;
      }
    }
    if (valid_weight < 0.5) return kVoid;
    return static_cast<float>(whole ? sum : sum / weight_sum);
  }

 private:
  [[nodiscard]] float coefficient(std::int64_t column, std::int64_t row) const {
    return band_.heights(mirror_index(column, axis_x_.samples()),
                         mirror_index(row, axis_z_.samples()) - band_.first_row);
  }

  [[nodiscard]] bool is_void(std::int64_t column, std::int64_t row) const {
    if (band_.voids.data() == nullptr) return std::isnan(coefficient(column, row));
    return band_.voids(mirror_index(column, axis_x_.samples()),
                       mirror_index(row, axis_z_.samples()) - band_.first_row) != 0;
  }

  /// Rows that the kernel itself does not read may lie outside the band; the nearest kernel has but one.
  [[nodiscard]] bool all_nearest_void(double u, double v) const {
    if (taps_ == 1) return false;
    for (const double row : {std::floor(v), std::ceil(v)}) {
      for (const double column : {std::floor(u), std::ceil(u)}) {
        if (!is_void(static_cast<std::int64_t>(column), static_cast<std::int64_t>(row))) return false;
      }
    }
    return true;
  }

  const SourceBand& band_;
  const SourceAxis& axis_x_;
  const SourceAxis& axis_z_;
  int taps_;
};

}  // namespace

TileCutter::TileCutter(const TileGrid& grid, const SourceAxis& axis_x, const SourceAxis& axis_z, const Kernel& kernel)
    : grid_(grid), axis_x_(axis_x), axis_z_(axis_z), kernel_(kernel) {}

RowRange TileCutter::rows_needed(std::int64_t tile_row) const {
  RowRange range{axis_z_.samples() - 1, 0};
  for (int r = 0; r < grid_.shape().rows(); ++r) {
    const double world = grid_.world_from_lattice(grid_.lattice_vertex({0, tile_row}, {0, r})).z;
    const std::int64_t first = kernel_.at(axis_z_.position(world)).first;
    for (std::int64_t row = first; row < first + kernel_.taps(); ++row) {
      const std::int64_t mirrored = mirror_index(row, axis_z_.samples());
      range.first = std::min(range.first, mirrored);
      range.last = std::max(range.last, mirrored);
    }
  }
  return range;
}

void TileCutter::cut(TileIndex tile, const SourceBand& band, std::span<float> heights) const {
  const int columns = grid_.shape().columns();
  const int rows = grid_.shape().rows();
  ISOHF_ASSERT(heights.size() == static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
  const std::array<ColumnTaps, 2> taps = {make_column_taps(grid_, axis_x_, kernel_, tile, 0),
                                          make_column_taps(grid_, axis_x_, kernel_, tile, 1)};
  std::vector<float> line(static_cast<std::size_t>(std::max(taps[0].width, taps[1].width)));
  std::vector<char> void_line(band.voids.data() != nullptr ? line.size() : 0);
  std::vector<char> near_void(static_cast<std::size_t>(columns), 0);
  const VoidAwareSampler void_aware(band, axis_x_, axis_z_, kernel_.taps());
  for (int r = 0; r < rows; ++r) {
    const std::span<float> out = heights.subspan(static_cast<std::size_t>(r) * static_cast<std::size_t>(columns),
                                                 static_cast<std::size_t>(columns));
    const double world = grid_.world_from_lattice(grid_.lattice_vertex(tile, {0, r})).z;
    if (!axis_z_.has_elevation(world)) {
      std::fill(out.begin(), out.end(), kVoid);
      continue;
    }
    const double v = axis_z_.position(world);
    const ColumnTaps& at = taps[static_cast<std::size_t>(r & 1)];
    const TapWeights row_taps = kernel_.at(v);
    blend_rows(band, row_taps, kernel_.taps(), axis_x_, axis_z_, at, line);
    gather_columns(kernel_.taps(), at, line.data(), out);
    if (!void_line.empty()) {
      find_voids(band, row_taps, kernel_.taps(), axis_x_, axis_z_, at, void_line, near_void);
    }
    for (std::size_t c = 0; c < out.size(); ++c) {
      if (std::isnan(out[c]) || near_void[c] != 0) out[c] = void_aware.at(at.position[c], v, at, c, row_taps);
    }
    if (at.any_outside) {
      for (std::size_t c = 0; c < out.size(); ++c) {
        if (at.outside[c] != 0) out[c] = kVoid;
      }
    }
  }
}

}  // namespace isohf
