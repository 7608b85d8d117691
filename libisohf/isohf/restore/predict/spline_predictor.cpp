#include "isohf/restore/predict/spline_predictor.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "isohf/base/assert.h"
#include "isohf/base/simd.h"
#include "isohf/restore/grid_sampler.h"
#include "isohf/sampling/resample/kernels.h"

namespace isohf {
namespace {

constexpr double kVoid = std::numeric_limits<double>::quiet_NaN();
/// Samples -> coefficients of the quintic B-spline through them: weights of the neighbours 0, 1, ... on either side, in
/// 16384ths that sum to 1.
constexpr std::array<double, 13> kInverse = {46566, -21655, 9393, -4048, 1743, -750, 323, -139, 60, -26, 11, -5, 2};
constexpr int kHalo = static_cast<int>(kInverse.size()) - 1;
static_assert(kHalo + 3 == SplinePredictor::kReach);
/// Vertices by which a row is continued at its ends: the taps of the spline, and the halo of each.
constexpr std::int64_t kMargin = 2;
constexpr std::int64_t kContinued = kMargin + kHalo;
/// Columns that are blended at once, in the nearest cache.
constexpr std::size_t kBlock = 512;
/// Columns of several rows that are read together where they lie in a file, and rows that are straightened together
/// then: each takes a few copies of itself.
constexpr std::int64_t kReadTogether = 2048;
constexpr std::int64_t kLinesInScratch = 2;

/// Sums in 16384ths, rounded to whole numbers, halves upwards.
ISOHF_KERNEL void round_sums(std::size_t count, double* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] = std::floor(sums[i] * 0x1p-14 + 0.5);
}
ISOHF_KERNEL void weigh(const double* __restrict in, double weight, std::size_t count, double* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] = weight * in[i];
}
ISOHF_KERNEL void add_weighted(const double* __restrict in, double weight, std::size_t count, double* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += weight * in[i];
}
ISOHF_KERNEL void add_two(const double* __restrict a, const double* __restrict b, double weight, std::size_t count,
                          double* __restrict sums) {
  for (std::size_t i = 0; i < count; ++i) sums[i] += weight * (a[i] + b[i]);
}

/// out [count]  coefficients at middle, middle + 1, ...; neighbour(j) [count] are the values j places on
template <typename Neighbour>
void invert(std::size_t count, const Neighbour& neighbour, double* out) {
  for (std::size_t from = 0; from < count; from += kBlock) {
    const std::size_t block = std::min(kBlock, count - from);
    double* const sums = out + from;
    vectorised<weigh>(neighbour(0) + from, kInverse[0], block, sums);
    for (int j = 1; j <= kHalo; ++j) {
      vectorised<add_two>(neighbour(-j) + from, neighbour(j) + from, kInverse[static_cast<std::size_t>(j)], block,
                          sums);
    }
    vectorised<round_sums>(block, sums);
  }
}

ISOHF_KERNEL void gather(const std::int32_t* __restrict start, const double* __restrict weights,
                         const double* __restrict line, std::size_t count, double* __restrict out) {
  for (std::size_t c = 0; c < count; ++c) {
    const double* const from = line + start[c];
    double sum = weights[c] * from[0];
    for (std::size_t t = 1; t < 6; ++t) sum += weights[t * count + c] * from[t];
    out[c] = std::floor(sum * 0x1p-14 + 0.5);
  }
}

/// Voids between two vertices on the straight line between them, rounded, halves upwards; those beyond the outermost
/// as that. False where all are void.
bool fill_voids(std::vector<double>& line) {
  const auto count = static_cast<std::int64_t>(line.size());
  std::int64_t before = -1;
  for (std::int64_t i = 0; i <= count; ++i) {
    if (i < count && std::isnan(line[static_cast<std::size_t>(i)])) continue;
    if (i == count && before < 0) return false;
    const double from = line[static_cast<std::size_t>(before < 0 ? i : before)];
    const double to = line[static_cast<std::size_t>(i == count ? before : i)];
    const auto rise = static_cast<std::int64_t>(to - from);
    const std::int64_t steps = i - before;
    for (std::int64_t k = before + 1; k < i; ++k) {
      const std::int64_t share = floor_divide(2 * rise * (k - before) + steps, 2 * steps);
      line[static_cast<std::size_t>(k)] = from + static_cast<double>(share);
    }
    before = i;
  }
  return true;
}

}  // namespace

std::array<int, 6> fixed_quintic(std::int64_t n) {
  const auto fifth = [](std::int64_t a) { return a * a * a * a * a; };
  const auto halves = [&](std::int64_t m) {  // the three weights that lie further than m / 512, nearest last
    const std::int64_t a = fifth(kPlaceParts - m);
    const std::int64_t b = fifth(2 * kPlaceParts - m);
    const std::int64_t c = fifth(3 * kPlaceParts - m);
    return std::array{a, b - 6 * a, c - 6 * b + 15 * a};
  };
  const auto weight = [](std::int64_t sum) {
    constexpr std::int64_t kUnit = std::int64_t{120} << 31U;  // 120 * 512^5 / 16384
    return static_cast<int>((sum + kUnit / 2) / kUnit);
  };
  const auto west = halves(n);
  const auto east = halves(kPlaceParts - n);
  std::array<int, 6> weights = {weight(west[0]), weight(west[1]), 0, weight(east[2]), weight(east[1]), weight(east[0])};
  weights[2] = 16384 - weights[0] - weights[1] - weights[3] - weights[4] - weights[5];
  return weights;
}

/// Some columns of the samples, and of the lattice rows.
struct SplinePredictor::Block {
  std::int64_t first;  ///< column
  RowParts<double> heights;
  RowParts<double> coefficients;
  RowParts<char> near_void;
};

SplinePredictor::SplinePredictor(const TileGrid& grid, bool wraps_x, const Quantisation& quantisation,
                                 int fraction_bits, ReadTile read_tile, const SampleGrid& samples,
                                 const ScratchFolder& scratch)
    : grid_(grid),
      wraps_x_(wraps_x),
      numbers_(quantisation, fraction_bits),
      samples_(samples),
      taps_{{static_cast<std::size_t>(samples.width), scratch}, {6 * static_cast<std::size_t>(samples.width), scratch}},
      tiles_(grid, quantisation, std::move(read_tile), 0, grid.tile_columns() - 1, scratch),
      in_scratch_(scratch.has_value()),
      heights_(static_cast<std::size_t>(samples.width), scratch),
      coefficients_(static_cast<std::size_t>(samples.width), scratch),
      near_void_(static_cast<std::size_t>(samples.width), scratch) {
  require_samples_near(samples, grid);
  const std::int64_t most = kPlaceParts * grid.shape().cell_columns() * grid.tile_columns();
  for (std::int64_t c = 0; c < samples.width; ++c) {
    const double x = samples.first_x + static_cast<double>(c) * samples.spacing_x;
    x_.push_back(static_cast<std::int64_t>(std::floor(x / grid.sigma_x() * 256.0 + 0.5)));
  }
  for (const std::int64_t parity : {0, 1}) {
    taps_.start.add(parity);
    taps_.weights.add(parity);
    for (std::size_t from = 0; from < x_.size(); from += kReadTogether) {
      const std::size_t count = std::min<std::size_t>(kReadTogether, x_.size() - from);
      std::vector<std::int32_t> starts(count);
      std::vector<double> all_weights(6 * count);
      for (std::size_t c = 0; c < count; ++c) {
        // Vertices of even lattice rows lie at object x = -1, 1, 3, ..., those of odd ones at -2, 0, 2, ...
        const std::int64_t place = std::clamp<std::int64_t>(x_[from + c], 0, most) + (parity == 0 ? 256 : 512);
        starts[c] = static_cast<std::int32_t>(place / kPlaceParts - 2 + kMargin);
        const std::array<int, 6> weights = fixed_quintic(place % kPlaceParts);
        for (std::size_t t = 0; t < 6; ++t) all_weights[t * count + c] = weights[t];
      }
      taps_.start.write(parity, from, starts);
      taps_.weights.write(parity, 6 * from, all_weights);
    }
  }
}

std::uint64_t SplinePredictor::kept_bytes(std::int64_t width, bool in_scratch) {
  return static_cast<std::uint64_t>(width) * (in_scratch ? 8U : 8U + 2U * 52U);
}

double SplinePredictor::rows_bytes(const TileGrid& grid, std::int64_t width, double lattice_rows, int threads,
                                   bool in_scratch) {
  const double all_rows = lattice_rows + 2.0 * kReach + 2.0;
  const double columns = in_scratch ? threads * static_cast<double>(kReadTogether) : static_cast<double>(width);
  if (in_scratch) return columns * all_rows * 17.0;
  return columns * all_rows * 17.0 + VertexRows::memory_bytes(grid, all_rows);
}

double SplinePredictor::lines_bytes(const TileGrid& grid, int threads, bool in_scratch) {
  const auto lines = static_cast<double>(in_scratch ? std::min<std::int64_t>(threads, kLinesInScratch) : threads);
  return lines * 24.0 * static_cast<double>(grid.tile_columns() * grid.shape().columns());
}

std::int64_t SplinePredictor::lattice_rows() const {
  return grid_.tile_rows() * grid_.shape().cell_rows() + 3;
}

std::int64_t SplinePredictor::tile_row_of(std::int64_t lattice_row) const {
  return std::clamp<std::int64_t>((lattice_row - 1) / grid_.shape().cell_rows(), 0, grid_.tile_rows() - 1);
}

std::int64_t SplinePredictor::z_of(std::int64_t row) const {
  const double z = samples_.first_z + static_cast<double>(row) * samples_.spacing_z;
  return static_cast<std::int64_t>(std::floor(z / grid_.sigma_z() * 512.0 + 0.5));
}

/// A lattice row, mirrored at the ends.
std::int64_t SplinePredictor::kept(std::int64_t lattice_row) const {
  return mirror_index(lattice_row, lattice_rows());
}

const SplinePredictor::LatticeRow& SplinePredictor::at(std::int64_t lattice_row) const {
  return lattice_rows_[static_cast<std::size_t>(kept(lattice_row) - first_lattice_row_)];
}

/// The vertices of a lattice row on the lattice: those that slid to a tile's edge are left out. A row that goes round
/// has each vertex once, from x = 1 or 0 on.
std::vector<double> SplinePredictor::line_of(std::int64_t lattice_row) const {
  const std::int64_t tile_row = tile_row_of(lattice_row);
  const std::int64_t columns = grid_.shape().columns();
  const std::int64_t cells = grid_.shape().cell_columns();
  const auto r = static_cast<int>(lattice_row - tile_row * grid_.shape().cell_rows());
  const std::int64_t first = r % 2 == 0 ? 2 : 1;
  const std::vector<double> vertices = numbers_.of(tiles_.read(tile_row, r));
  std::vector<double> line;
  line.reserve(static_cast<std::size_t>(cells * grid_.tile_columns() + 3));
  const auto row_of = [&](std::int64_t tile) { return vertices.data() + tile * columns; };
  if (!wraps_x_) line.push_back(row_of(0)[0]);
  for (std::int64_t t = 0; t < grid_.tile_columns(); ++t) {
    line.insert(line.end(), row_of(t) + first, row_of(t) + first + cells);
  }
  if (wraps_x_) return line;
  const double* const last = row_of(grid_.tile_columns() - 1);
  if (first == 2) {
    line.push_back(last[columns - 1]);
  } else {
    line.insert(line.end(), last + columns - 3, last + columns - 1);
  }
  return line;
}

void SplinePredictor::straighten(std::int64_t lattice_row) {
  LatticeRow& made = lattice_rows_[static_cast<std::size_t>(lattice_row - first_lattice_row_)];
  std::vector<double> line = line_of(lattice_row);
  const auto count = static_cast<std::int64_t>(line.size());
  std::vector<char> voids;
  if (std::any_of(line.begin(), line.end(), [](double n) { return std::isnan(n); })) {
    for (const double n : line) voids.push_back(std::isnan(n) ? 1 : 0);
    made.is_void = !fill_voids(line);
    if (made.is_void) return;
  }
  const auto continued = [&](std::int64_t k) {
    return static_cast<std::size_t>(wraps_x_ ? ((k - 1) % count + count) % count : mirror_index(k, count));
  };
  std::vector<double> wide;
  const std::int64_t end = count + (wraps_x_ ? 1 : 0);  // of the vertices from object x = -1 or -2 on
  const std::int64_t taps_end = end + 2 * kMargin;
  wide.reserve(static_cast<std::size_t>(end + 2 * kContinued));
  for (std::int64_t k = -kContinued; k < 0; ++k) wide.push_back(line[continued(k)]);
  if (wraps_x_) wide.push_back(line[continued(0)]);
  wide.insert(wide.end(), line.begin(), line.end());
  for (std::int64_t k = end; k < end + kContinued + 2; ++k) wide.push_back(line[continued(k)]);
  std::vector<double> coefficients(static_cast<std::size_t>(taps_end) + 2);
  invert(
      coefficients.size(), [&](int j) { return wide.data() + kHalo + j; }, coefficients.data());
  const std::int64_t parity = lattice_row % 2;
  std::vector<double>& heights = wide;  // which is done with
  heights.resize(x_.size());
  std::vector<char> near(voids.empty() ? 0 : x_.size(), 0);
  std::vector<std::int32_t> starts;
  std::vector<double> weights;
  for (std::size_t from = 0; from < x_.size(); from += kReadTogether) {
    const std::size_t width = std::min<std::size_t>(kReadTogether, x_.size() - from);
    const auto start = taps_.start.read(parity, from, width, starts);
    vectorised<gather>(start.data(), taps_.weights.read(parity, 6 * from, 6 * width, weights).data(),
                       coefficients.data(), width, heights.data() + from);
    if (voids.empty()) continue;
    for (std::size_t c = 0; c < width; ++c) {
      for (std::int64_t t = 0; t < 6; ++t) near[from + c] |= voids[continued(start[c] - kMargin + t)];
    }
  }
  heights_.write(lattice_row, 0, heights);
  if (voids.empty()) return;
  near_void_.write(lattice_row, 0, near);
  made.is_near_void = true;
}

/// Rows without an elevation are stood in for by the last one before them that has any, seen from this row.
void SplinePredictor::make_coefficients(std::int64_t lattice_row, Block& block) {
  const std::span<const double> heights = block.heights.row(lattice_row);
  std::array<const double*, 2 * kHalo + 1> rows{};
  rows[kHalo] = heights.data();
  for (std::size_t j = 1; j <= kHalo; ++j) {
    const auto step = static_cast<std::int64_t>(j);
    const auto row_at = [&](std::int64_t row, const double* nearer) {
      return at(row).is_void ? nearer : block.heights.row(kept(row)).data();
    };
    rows[kHalo - j] = row_at(lattice_row - step, rows[kHalo - j + 1]);
    rows[kHalo + j] = row_at(lattice_row + step, rows[kHalo + j - 1]);
  }
  std::vector<double> coefficients(heights.size());
  invert(
      heights.size(), [&](int j) { return rows[static_cast<std::size_t>(kHalo + j)]; }, coefficients.data());
  coefficients_.write(lattice_row, static_cast<std::size_t>(block.first), coefficients);
}

/// Drops the lattice rows before `first` and makes those up to `last`.
void SplinePredictor::keep_lattice_rows(std::int64_t first, std::int64_t last) {
  while (!lattice_rows_.empty() && first_lattice_row_ < first) {
    heights_.drop(first_lattice_row_);
    near_void_.drop(first_lattice_row_);
    if (lattice_rows_.front().has_coefficients) coefficients_.drop(first_lattice_row_);
    lattice_rows_.pop_front();
    ++first_lattice_row_;
  }
  if (lattice_rows_.empty()) first_lattice_row_ = first;
  for (;;) {
    const std::int64_t next = first_lattice_row_ + static_cast<std::int64_t>(lattice_rows_.size());
    if (next > last) return;
    const std::int64_t tile_row = tile_row_of(next);
    tiles_.have(tile_row);
    std::int64_t end = next;
    for (; end <= last && tile_row_of(end) == tile_row; ++end) {
      heights_.add(end);
      near_void_.add(end);
      lattice_rows_.emplace_back();
    }
    const std::int64_t strands = in_scratch_ ? std::min(kLinesInScratch, end - next) : end - next;
    oneapi::tbb::parallel_for(std::int64_t{0}, strands, [&](std::int64_t strand) {
      for (std::int64_t row = next + strand; row < end; row += strands) straighten(row);
    });
  }
}

/// The lattice rows at or before the first and the last of some rows of samples.
RowRange SplinePredictor::middles(std::int64_t first, std::int64_t rows) const {
  const std::int64_t last_z = kPlaceParts * (lattice_rows() - 3);
  const auto middle = [&](std::int64_t row) {
    return std::clamp<std::int64_t>(z_of(row), 0, last_z) / kPlaceParts + 1;
  };
  return {middle(first), middle(first + rows - 1)};
}

/// What is mirrored at an end lies less far inside.
RowRange SplinePredictor::lattice_rows_needed(const RowRange& middles) const {
  return {std::max<std::int64_t>(middles.first - kReach + 1, 0), std::min(middles.last + kReach, lattice_rows() - 1)};
}

RowRange SplinePredictor::tile_rows_needed(std::int64_t first, std::int64_t rows) const {
  const RowRange needed = lattice_rows_needed(middles(first, rows));
  return {tile_row_of(needed.first), tile_row_of(needed.last)};
}

void SplinePredictor::read(std::int64_t first, std::int64_t rows, std::span<double> elevations) {
  ISOHF_ASSERT(elevations.size() == static_cast<std::size_t>(rows * samples_.width));
  const std::int64_t count = lattice_rows();
  const auto [north, south] = middles(first, rows);
  const auto [low, high] = lattice_rows_needed({north, south});
  for (std::int64_t row = tile_row_of(north); row <= tile_row_of(south); ++row) tiles_.have(row);
  keep_lattice_rows(low, high);
  std::vector<std::int64_t> wanted;
  for (std::int64_t row = std::max<std::int64_t>(north - 2, 0); row <= std::min(south + 3, count - 1); ++row) {
    LatticeRow& made = lattice_rows_[static_cast<std::size_t>(row - first_lattice_row_)];
    if (made.is_void || made.has_coefficients) continue;
    coefficients_.add(row);
    made.has_coefficients = true;
    wanted.push_back(row);
  }
  for_each_block(static_cast<std::int64_t>(wanted.size()),
                 [&](std::int64_t i, Block& block) { make_coefficients(wanted[static_cast<std::size_t>(i)], block); });
  for_each_block(rows, [&](std::int64_t i, Block& block) {
    const auto width = static_cast<std::size_t>(std::min(kReadTogether, samples_.width - block.first));
    read_row(first + i, block, elevations.subspan(static_cast<std::size_t>(i * samples_.width + block.first), width));
  });
  // What lies North of the next row's tiles is done with.
  tiles_.drop_before(tile_row_of(middles(first + rows, 1).first));
}

/// Every row in blocks of columns; what lies in a file is read once for all rows.
template <typename Use>
void SplinePredictor::for_each_block(std::int64_t rows, const Use& use) {
  const std::int64_t blocks = (samples_.width + kReadTogether - 1) / kReadTogether;
  const std::int64_t together = in_scratch_ ? std::max<std::int64_t>(rows, 1) : 1;
  oneapi::tbb::parallel_for(std::int64_t{0}, blocks * (rows / together), [&](std::int64_t part) {
    const std::int64_t column = part % blocks * kReadTogether;
    const auto from = static_cast<std::size_t>(column);
    const auto count = static_cast<std::size_t>(std::min(kReadTogether, samples_.width - column));
    Block block{column,
                {heights_, first_lattice_row_, from, count},
                {coefficients_, first_lattice_row_, from, count},
                {near_void_, first_lattice_row_, from, count}};
    const std::int64_t start = part / blocks * together;
    for (std::int64_t row = start; row < start + together; ++row) use(row, block);
  });
}

/// Fills in the samples of a row that are marked.
void SplinePredictor::read_triangles(std::int64_t z, std::int64_t first, const std::vector<char>& here,
                                     std::span<double> out) const {
  std::optional<TriangleRows> vertices;
  for (std::size_t c = 0; c < out.size(); ++c) {
    FixedTilePlace found{};
    if (here[c] == 0 || !locate(grid_, {x_[static_cast<std::size_t>(first) + c], z}, found)) continue;
    if (!vertices) {
      FixedTilePlace last{};
      const std::int64_t most = kPlaceParts * grid_.shape().cell_columns() * grid_.tile_columns();
      (void)locate(grid_, {std::min(x_[static_cast<std::size_t>(first) + out.size() - 1], most), z}, last);
      vertices.emplace(tiles_, grid_.shape(), found.tile.row, static_cast<double>(found.place.z) / kPlaceParts,
                       found.tile.column, last.tile.column - found.tile.column + 1);
    }
    out[c] = numbers_.elevation(fixed_height(fixed_triangle(grid_.shape(), found.place), [&](GridVertex vertex) {
      return numbers_.at(vertices->codes(), vertices->at(found.tile.column, vertex));
    }));
  }
}

void SplinePredictor::read_row(std::int64_t row, Block& block, std::span<double> out) const {
  const std::int64_t z = z_of(row);
  const std::int64_t last_z = kPlaceParts * (lattice_rows() - 3);
  const std::int64_t last_x = kPlaceParts * grid_.shape().cell_columns() * grid_.tile_columns();
  if (z < 0 || z > last_z) {
    std::fill(out.begin(), out.end(), kVoid);
    return;
  }
  const std::int64_t middle = z / kPlaceParts + 1;
  const std::array<int, 6> weights = fixed_quintic(z % kPlaceParts);
  std::vector<char> near;
  bool any_void_row = false;
  for (std::int64_t t = 0; t < 6; ++t) {
    const LatticeRow& read = at(middle - 2 + t);
    any_void_row = any_void_row || read.is_void;
    if (!read.is_near_void) continue;
    near.resize(out.size());
    const std::span<const char> voids = block.near_void.row(kept(middle - 2 + t));
    for (std::size_t c = 0; c < near.size(); ++c) near[c] |= voids[c];
  }
  if (any_void_row) {
    near.assign(out.size(), 1);
  } else {
    for (std::size_t from = 0; from < out.size(); from += kBlock) {
      const std::size_t count = std::min(kBlock, out.size() - from);
      double* const sums = out.data() + from;
      for (std::int64_t t = 0; t < 6; ++t) {
        const double* const read = block.coefficients.row(kept(middle - 2 + t)).data() + from;
        const double weight = weights[static_cast<std::size_t>(t)];
        t == 0 ? vectorised<weigh>(read, weight, count, sums) : vectorised<add_weighted>(read, weight, count, sums);
      }
      vectorised<round_sums>(count, sums);
      for (std::size_t c = 0; c < count; ++c) sums[c] = numbers_.elevation(sums[c]);
    }
  }
  for (std::size_t c = 0; c < out.size(); ++c) {
    const std::int64_t x = x_[static_cast<std::size_t>(block.first) + c];
    if (x < 0 || x > last_x || (!near.empty() && near[c] != 0)) out[c] = kVoid;
  }
  if (!near.empty()) read_triangles(z, block.first, near, out);
}

}  // namespace isohf
