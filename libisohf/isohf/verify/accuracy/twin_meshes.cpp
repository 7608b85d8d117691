#include "isohf/verify/accuracy/twin_meshes.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <optional>
#include <vector>

#include "isohf/archive/codec/quantise.h"
#include "isohf/archive/codec/tile_codes.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/surface/resample/prefilter.h"
#include "isohf/surface/resample/row_sampler.h"
#include "isohf/surface/source/band_reader.h"
#include "isohf/verify/accuracy/error_statistics.h"
#include "isohf/verify/accuracy/plain_coding.h"

namespace isohf {
namespace {

/// What all meshes over one surface share.
struct MeshGround {
  const Metadata& surface;
  SourceAxis axis_x;
  SourceAxis axis_z;
  Kernel kernel;
  RowSampler sampler;
  double datum;

  static MeshGround make(const Metadata& surface, const Kernel& kernel, double datum, double spacing);
};

/// The rows of one mesh, made from North to South and kept while they are needed; elevations as an archive of them
/// would give them back.
///
///   open(z, z')     add_rows_needed     fill(0) ... fill(opened - 1), in any order, on any thread     close()
class MeshRows {
 public:
  MeshRows(const MeshGround& ground, const MeshLayout& layout, MeshPlacement placement, bool is_coded);

  /// Drops the rows that nothing at world_z or South of it needs, and makes room for those that places down to
  /// world_end do; down to the end of the ground where that is infinite.
  void open(double world_z, double world_end);
  [[nodiscard]] std::int64_t opened() const { return end_row_ - filled_row_; }
  void add_rows_needed(RowRange& range) const;
  void fill(std::int64_t index, const SourceBand& band, RowSampler::Scratch& scratch);
  /// Codes what has become whole tiles. The calling thread's task arena works on them.
  void close();

  /// A place between vertices, along one axis.
  struct Place {
    std::int64_t index;  ///< of the vertex at or before it
    double share;        ///< of the way to the next one
  };
  /// `slide`: how far East of the first row's the vertices lie there, in spacings.
  [[nodiscard]] Place column_at(double world_x, double slide) const {
    return place((world_x - first_x_) / layout_.spacing_x - slide, columns_);
  }
  [[nodiscard]] Place row_at(double world_z) const { return place((world_z - first_z_) / layout_.spacing_z, rows_); }
  /// A row that is kept: one before the place that was opened to two behind it. [columns], NaN where void; nullptr
  /// beyond the mesh.
  [[nodiscard]] const double* row(std::int64_t row) const {
    return row < 0 || row >= rows_ ? nullptr : kept_[static_cast<std::size_t>(row - first_row_)].data();
  }
  [[nodiscard]] std::int64_t columns() const { return columns_; }
  [[nodiscard]] bool is_iso() const { return layout_.kind == MeshLayout::Kind::kIso; }

  [[nodiscard]] std::int64_t clamped() const { return clamped_total_; }
  [[nodiscard]] std::uint64_t plain_bytes() const { return plain_bytes_; }

 private:
  [[nodiscard]] static Place place(double at, std::int64_t count);
  [[nodiscard]] double world_z(std::int64_t row) const {
    return first_z_ + static_cast<double>(row) * layout_.spacing_z;
  }
  void code_tiles(std::int64_t rows);

  const MeshGround& ground_;
  MeshLayout layout_;
  double first_x_;
  double first_z_;
  std::int64_t columns_;
  std::int64_t rows_;
  std::array<ColumnTaps, 2> taps_;  ///< of even and odd rows
  bool is_coded_;
  std::int64_t first_row_ = 0;   ///< of those that are kept
  std::int64_t filled_row_ = 0;  ///< one past the last that is filled
  std::int64_t end_row_ = 0;     ///< one past the last that is open
  std::deque<std::vector<double>> kept_;
  std::vector<std::int64_t> clamped_;  ///< of the open rows
  std::int64_t clamped_total_ = 0;
  std::deque<TileCodes> codes_;  ///< rows that are not coded yet
  std::int64_t coded_rows_ = 0;
  std::uint64_t plain_bytes_ = 0;
};

constexpr std::int64_t kTileSide = 256;

ElevationRange code_range(const Metadata& surface, double datum) {
  const CodeLimits limits = code_limits(surface);
  return {limits.lowest - datum, limits.highest - datum};
}

/// Appends columns [first, first + count) of a row.
void append(const TileCodes& row, std::size_t first, std::size_t count, TileCodes& tile) {
  const auto at = static_cast<std::ptrdiff_t>(first);
  const auto end = static_cast<std::ptrdiff_t>(first + count);
  if (row.type == CodeType::kF32) {
    tile.heights.insert(tile.heights.end(), row.heights.begin() + at, row.heights.begin() + end);
  } else {
    tile.codes.insert(tile.codes.end(), row.codes.begin() + at, row.codes.begin() + end);
  }
}

MeshGround MeshGround::make(const Metadata& surface, const Kernel& kernel, double datum, double spacing) {
  const SourceRecord& source = surface.source;
  const Registration registration = source.registration;
  const Outside outside = known(surface.outside, "outside");
  const double continued = kContinuedSteps * spacing;
  const SourceAxis x(source.width, source.first_sample_x, source.spacing_x, registration, outside, continued);
  const SourceAxis z(source.height, source.first_sample_z, source.spacing_z, registration, outside, continued);
  return {surface, x, z, kernel, RowSampler(x, z, kernel, code_range(surface, datum)), datum};
}

MeshRows::MeshRows(const MeshGround& ground, const MeshLayout& layout, MeshPlacement placement, bool is_coded)
    : ground_(ground), layout_(layout), is_coded_(is_coded) {
  if (layout_.kind == MeshLayout::Kind::kDecimated) {
    // The sample before the placement, or one stride before that, so that the first sample lies on the mesh.
    const auto first = [](double sample, double spacing, double step, double share) {
      const double skipped = std::floor(share * std::round(step / spacing));
      return sample + skipped * spacing - (skipped > 0.0 ? step : 0.0);
    };
    const SourceRecord& source = ground.surface.source;
    first_x_ = first(source.first_sample_x, source.spacing_x, layout_.spacing_x, placement.x);
    first_z_ = first(source.first_sample_z, source.spacing_z, layout_.spacing_z, placement.z);
  } else {
    first_x_ = -(placement.x + (is_iso() ? 1.0 : 0.0)) * layout_.spacing_x;  // odd rows begin half a spacing later
    first_z_ = -placement.z * layout_.spacing_z;
  }
  const TileGrid& grid = ground.surface.grid;
  columns_ = 2 + static_cast<std::int64_t>((grid.world_width() - first_x_) / layout_.spacing_x);
  rows_ = 2 + static_cast<std::int64_t>((grid.world_height() - first_z_) / layout_.spacing_z);
  std::vector<double> world_x(static_cast<std::size_t>(columns_));
  for (std::size_t parity = 0; parity < (is_iso() ? 2 : 1); ++parity) {
    const double slide = parity == 0 ? 0.0 : 0.5;
    for (std::size_t c = 0; c < world_x.size(); ++c) {
      world_x[c] = first_x_ + (static_cast<double>(c) + slide) * layout_.spacing_x;
    }
    taps_[parity] = make_column_taps(ground_.axis_x, ground_.kernel, world_x);
  }
}

MeshRows::Place MeshRows::place(double at, std::int64_t count) {
  const std::int64_t index = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(at)), 0, count - 2);
  return {index, std::clamp(at - static_cast<double>(index), 0.0, 1.0)};
}

void MeshRows::open(double world_z, double world_end) {
  const std::int64_t first = std::max<std::int64_t>(row_at(world_z).index - 1, 0);
  end_row_ = std::isinf(world_end) ? rows_ : std::min(std::max(end_row_, row_at(world_end).index + 3), rows_);
  while (!kept_.empty() && first_row_ < first) {
    kept_.pop_front();
    ++first_row_;
  }
  kept_.resize(static_cast<std::size_t>(end_row_ - first_row_));
  clamped_.assign(static_cast<std::size_t>(opened()), 0);
  if (is_coded_) codes_.resize(codes_.size() + clamped_.size());
}

void MeshRows::add_rows_needed(RowRange& range) const {
  for (std::int64_t row = filled_row_; row < end_row_; ++row) ground_.sampler.add_rows_needed(world_z(row), range);
}

void MeshRows::fill(std::int64_t index, const SourceBand& band, RowSampler::Scratch& scratch) {
  const std::int64_t row = filled_row_ + index;
  std::vector<float> heights(static_cast<std::size_t>(columns_));
  const ColumnTaps& taps = taps_[is_iso() ? static_cast<std::size_t>(row % 2) : 0];
  ground_.sampler.sample(band, world_z(row), taps, scratch, heights);
  TileCodes codes;
  const Quantisation& quantisation = ground_.surface.quantisation;
  const QuantiserCounts counts = quantise(quantisation, code_limits(ground_.surface), ground_.datum, heights, codes);
  clamped_[static_cast<std::size_t>(index)] = counts.below + counts.above;
  kept_[static_cast<std::size_t>(row - first_row_)] = elevations_of(codes, quantisation);
  if (is_coded_) codes_[codes_.size() - static_cast<std::size_t>(opened() - index)] = std::move(codes);
}

void MeshRows::close() {
  filled_row_ = end_row_;
  for (const std::int64_t count : clamped_) clamped_total_ += count;
  while (static_cast<std::int64_t>(codes_.size()) >= kTileSide) code_tiles(kTileSide);
  if (end_row_ == rows_ && !codes_.empty()) code_tiles(static_cast<std::int64_t>(codes_.size()));
}

void MeshRows::code_tiles(std::int64_t rows) {
  // As many rows and columns as the ground holds spacings: the next ground's first vertices are not this one's.
  const auto spacings = [](double length, double spacing) { return std::max(std::llround(length / spacing), 1LL); };
  const TileGrid& grid = ground_.surface.grid;
  const std::int64_t columns = std::min<std::int64_t>(spacings(grid.world_width(), layout_.spacing_x), columns_);
  const std::int64_t wanted = spacings(grid.world_height(), layout_.spacing_z) - coded_rows_;
  coded_rows_ += rows;
  const auto tile_rows = static_cast<std::size_t>(std::clamp<std::int64_t>(wanted, 0, rows));
  std::vector<std::uint64_t> bytes(static_cast<std::size_t>((columns + kTileSide - 1) / kTileSide));
  oneapi::tbb::parallel_for(std::size_t{0}, bytes.size(), [&](std::size_t t) {
    const auto first = static_cast<std::int64_t>(t) * kTileSide;
    const std::int64_t width = std::min(kTileSide, columns - first);
    TileCodes tile;
    tile.type = ground_.surface.quantisation.type;
    for (std::size_t r = 0; r < tile_rows; ++r) {
      append(codes_[r], static_cast<std::size_t>(first), static_cast<std::size_t>(width), tile);
    }
    if (tile_rows > 0) bytes[t] = plainly_coded_bytes(tile, std::vector<std::int64_t>(tile_rows, width));
  });
  for (const std::uint64_t tile : bytes) plain_bytes_ += tile;
  codes_.erase(codes_.begin(), codes_.begin() + rows);
}

/// The elevations of the vertices of one square, or of two triangles of a lattice: West to East, the North ones first.
struct Square {
  std::array<double, 4> heights;

  /// Both meshes at (u, v) in [0, 1], [diagonal]. A vertex of weight 0 is not read; NaN where another is void.
  [[nodiscard]] std::array<double, 2> at(double u, double v) const {
    const auto& [nw, ne, sw, se] = heights;
    const double fold = nw - ne - sw + se;
    if (std::isnan(fold)) {
      return {blend(u >= v ? falling_above(u, v) : falling_below(u, v)),
              blend(u + v <= 1.0 ? rising_above(u, v) : rising_below(u, v))};
    }
    // The plane through three vertices, folded along the diagonal: no branch that nothing predicts.
    const double plane = nw + u * (ne - nw) + v * (sw - nw);
    return {plane + std::min(u, v) * fold, plane + std::max(u + v - 1.0, 0.0) * fold};
  }

 private:
  using Weights = std::array<double, 4>;
  static Weights falling_above(double u, double v) { return {1.0 - u, u - v, 0.0, v}; }
  static Weights falling_below(double u, double v) { return {1.0 - v, 0.0, v - u, u}; }
  static Weights rising_above(double u, double v) { return {1.0 - u - v, u, v, 0.0}; }
  static Weights rising_below(double u, double v) { return {0.0, 1.0 - v, 1.0 - u, u + v - 1.0}; }

  [[nodiscard]] double blend(const Weights& weights) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      if (weights[i] > 0.0) sum += weights[i] * heights[i];
    }
    return sum;
  }
};

/// Along which diagonal a square's vertices bend less: the sum of the absolute second differences at its two ends, along
/// it and on to the next vertex. Where a vertex around is missing, the shorter diagonal.
Diagonal least_curved(const Square& square, const double* before, const double* after, std::int64_t column,
                      std::int64_t columns) {
  const auto& [nw, ne, sw, se] = square.heights;
  if (before != nullptr && after != nullptr && column > 0 && column + 2 < columns) {
    const std::int64_t west = column - 1;
    const std::int64_t east = column + 2;
    const double falling = std::abs(before[west] - 2.0 * nw + se) + std::abs(nw - 2.0 * se + after[east]);
    const double rising = std::abs(after[west] - 2.0 * sw + ne) + std::abs(sw - 2.0 * ne + before[east]);
    if (!std::isnan(falling) && !std::isnan(rising)) return falling <= rising ? Diagonal::kFalling : Diagonal::kRising;
  }
  return std::abs(nw - se) > std::abs(ne - sw) ? Diagonal::kRising : Diagonal::kFalling;
}

/// One mesh at one place, and what its errors add up to.
class PlacedMesh {
 public:
  PlacedMesh(const MeshGround& ground, const MeshLayout& layout, MeshPlacement placement, bool is_coded)
      : rows(ground, layout, placement, is_coded), histograms(layout.in_full ? 2 : 0) {
    if (!rows.is_iso()) squares_.resize(static_cast<std::size_t>(rows.columns()));
  }

  /// Compares a row of the source: its samples, [columns], relative to the datum, and where they lie.
  void compare(const float* samples, std::span<const double> world_x, double world_z, double datum) {
    const MeshRows::Place place = rows.row_at(world_z);
    rows.is_iso() ? compare_iso(samples, world_x, place, datum) : compare_ortho(samples, world_x, place, datum);
  }
  /// After the last row.
  void finish() { close_squares(); }

  MeshRows rows;
  std::array<ErrorSums, 2> sums;  ///< [diagonal]; a lattice's all stand in the first
  ErrorSums least_curvature;
  double best_squares = 0.0;
  std::int64_t best_count = 0;
  std::vector<ErrorHistogram> histograms;  ///< [diagonal], where p99 is asked for

 private:
  void compare_iso(const float* samples, std::span<const double> world_x, MeshRows::Place place, double datum) {
    const double* const north = rows.row(place.index);
    const double* const south = rows.row(place.index + 1);
    // Two rows are squares pushed over by half a spacing, East or back West; their shorter diagonal is the lattice's side.
    const bool is_odd = place.index % 2 != 0;
    const double slide = 0.5 * (is_odd ? 1.0 - place.share : place.share);
    for (std::size_t c = 0; c < world_x.size(); ++c) {
      if (std::isnan(samples[c])) continue;
      const auto [i, u] = rows.column_at(world_x[c], slide);
      const Square square{{north[i], north[i + 1], south[i], south[i + 1]}};
      const double error = std::abs(square.at(u, place.share)[is_odd ? 0 : 1] - (double{samples[c]} + datum));
      if (!std::isnan(error)) sums[0].add(error, {});
    }
  }

  void compare_ortho(const float* samples, std::span<const double> world_x, MeshRows::Place place, double datum) {
    if (place.index != square_row_) close_squares();
    square_row_ = place.index;
    const double* const before = rows.row(place.index - 1);
    const double* const north = rows.row(place.index);
    const double* const south = rows.row(place.index + 1);
    const double* const after = rows.row(place.index + 2);
    for (std::size_t c = 0; c < world_x.size(); ++c) {
      if (std::isnan(samples[c])) continue;
      const auto [i, u] = rows.column_at(world_x[c], 0.0);
      const Square square{{north[i], north[i + 1], south[i], south[i + 1]}};
      const std::array<double, 2> found = square.at(u, place.share);
      std::array<double, 2> error{};
      for (std::size_t d = 0; d < 2; ++d) {
        error[d] = std::abs(found[d] - (double{samples[c]} + datum));
        if (std::isnan(error[d])) continue;
        sums[d].add(error[d], {});
        if (!histograms.empty()) histograms[d].add(error[d]);
      }
      if (std::isnan(error[0] + error[1])) continue;
      const Diagonal cut = least_curved(square, before, after, i, rows.columns());
      least_curvature.add(error[cut == Diagonal::kFalling ? 0 : 1], {});
      for (std::size_t d = 0; d < 2; ++d) squares_[static_cast<std::size_t>(i)][d] += error[d] * error[d];
      ++best_count;
    }
  }

  void close_squares() {
    for (std::array<double, 2>& square : squares_) best_squares += std::min(square[0], square[1]);
    std::fill(squares_.begin(), squares_.end(), std::array<double, 2>{});
  }

  std::int64_t square_row_ = -1;
  std::vector<std::array<double, 2>> squares_;  ///< [column][diagonal] sums of squared errors, of one row of squares
};

constexpr std::size_t kPlacements = std::size(kMeshPlacements);

class MeshComparison {
 public:
  MeshComparison(const Metadata& surface, HeightSource& source, std::span<const MeshLayout> layouts)
      : record_(surface.source),
        source_(source),
        info_(source.info()),
        layouts_(layouts),
        range_{surface.statistics.min.value_or(0.0), surface.statistics.max.value_or(0.0)},
        datum_(choose_datum(range_)),
        kernel_(Kernel::make(known(surface.filter, "filter"), known(surface.edges, "edges"))),
        prefilter_(Prefilter::make(kernel_.filter(), known(surface.acquisition, "acquisition"), kernel_.edges())),
        world_x_(static_cast<std::size_t>(info_.width)) {
    for (std::size_t c = 0; c < world_x_.size(); ++c) {
      world_x_[c] = record_.first_sample_x + static_cast<double>(c) * record_.spacing_x;
    }
    for (const MeshLayout& layout : layouts) {
      const double spacing = std::max(layout.spacing_x, layout.spacing_z);
      const MeshGround& ground = grounds_.emplace_back(MeshGround::make(surface, kernel_, datum_, spacing));
      for (const MeshPlacement& placement : kMeshPlacements) {
        meshes_.emplace_back(ground, layout, placement, layout.in_full && &placement == kMeshPlacements);
      }
    }
  }

  std::vector<MeshErrors> run(const std::string& stage, const Job& job) {
    const Prefilter as_they_are = Prefilter::make(Filter::kBilinear, {});
    BandReader samples(source_, datum_, as_they_are);
    std::optional<BandReader> coefficients;
    if (!prefilter_.is_identity()) coefficients.emplace(source_, datum_, prefilter_);
    // About as many rows of vertices whatever the spacing: memory is that of these rows and of their band.
    const double spacing = layouts_.front().spacing_z;
    const auto strip = std::clamp<std::int64_t>(std::llround(32.0 * spacing / record_.spacing_z), 4, 64);
    for (std::int64_t first = 0; first < info_.height; first += strip) {
      job.throw_if_cancelled();
      const std::int64_t end = std::min(first + strip, info_.height);
      const bool is_last = end == info_.height;
      RowRange rows = RowSampler::no_rows();
      for (PlacedMesh& mesh : meshes_) {
        mesh.rows.open(world_z(first), is_last ? std::numeric_limits<double>::infinity() : world_z(end - 1));
        mesh.rows.add_rows_needed(rows);
      }
      const RowRange compared{first, end - 1};
      if (coefficients) {
        if (rows.first <= rows.last) fill_meshes(*coefficients->read(rows));
        compare_rows(*samples.read(compared), first, end);
      } else {
        const auto band = samples.read({std::min(rows.first, first), std::max(rows.last, end - 1)});
        fill_meshes(*band);
        compare_rows(*band, first, end);
      }
      job.report({stage, "rows", end, info_.height});
    }
    std::vector<MeshErrors> errors;
    for (std::size_t i = 0; i < layouts_.size(); ++i) errors.push_back(result(i));
    return errors;
  }

 private:
  [[nodiscard]] double world_z(std::int64_t row) const {
    return record_.first_sample_z + static_cast<double>(row) * record_.spacing_z;
  }

  void fill_meshes(const Band& band) {
    std::vector<std::pair<MeshRows*, std::int64_t>> rows;
    for (PlacedMesh& mesh : meshes_) {
      for (std::int64_t i = 0; i < mesh.rows.opened(); ++i) rows.emplace_back(&mesh.rows, i);
    }
    const SourceBand view = band.view();
    oneapi::tbb::parallel_for(std::size_t{0}, rows.size(),
                              [&](std::size_t i) { rows[i].first->fill(rows[i].second, view, scratches_.local()); });
    for (PlacedMesh& mesh : meshes_) mesh.rows.close();
  }

  /// Each mesh goes through its rows alone: what it adds up is the same for any number of threads.
  void compare_rows(const Band& band, std::int64_t first, std::int64_t end) {
    oneapi::tbb::parallel_for(std::size_t{0}, meshes_.size(), [&](std::size_t m) {
      for (std::int64_t row = first; row < end; ++row) {
        meshes_[m].compare(band.view().heights.row(row - band.rows.first), world_x_, world_z(row), datum_);
      }
      if (end == info_.height) meshes_[m].finish();
    });
  }

  [[nodiscard]] MeshErrors result(std::size_t layout) const {
    std::array<ErrorSums, 2> all{};
    std::array<double, 2> max{};
    ErrorSums least;
    double best_squares = 0.0;
    std::int64_t best_count = 0;
    const std::size_t first = layout * kPlacements;
    for (std::size_t p = first; p < first + kPlacements; ++p) {
      const PlacedMesh& mesh = meshes_[p];
      for (std::size_t d = 0; d < 2; ++d) {
        all[d].add(mesh.sums[d]);
        max[d] += mesh.sums[d].max / static_cast<double>(kPlacements);
      }
      least.add(mesh.least_curvature);
      best_squares += mesh.best_squares;
      best_count += mesh.best_count;
    }
    MeshErrors errors;
    errors.layout = layouts_[layout];
    const bool is_iso = errors.layout.kind == MeshLayout::Kind::kIso;
    const std::size_t d = !is_iso && all[1].rms() < all[0].rms() ? 1 : 0;
    const TileGrid& grid = grounds_[layout].surface.grid;
    errors.vertices =
        std::llround(grid.world_width() / errors.layout.spacing_x * (grid.world_height() / errors.layout.spacing_z));
    errors.compared = all[d].count / static_cast<std::int64_t>(kPlacements);
    errors.rms = all[d].rms();
    errors.max = max[d];
    errors.clamped = meshes_[first].rows.clamped();
    errors.psnr_db = psnr_db(range_.max - range_.min, errors.rms);
    if (is_iso) return errors;
    errors.diagonal = d == 0 ? Diagonal::kFalling : Diagonal::kRising;
    errors.rms_of_other = all[1 - d].rms();
    errors.rms_least_curvature = least.rms();
    if (best_count > 0) errors.rms_best = std::sqrt(best_squares / static_cast<double>(best_count));
    if (errors.layout.in_full) {
      ErrorHistogram histogram;
      for (std::size_t p = first; p < first + kPlacements; ++p) histogram.add(meshes_[p].histograms[d]);
      errors.p99 = std::min(histogram.percentile(0.99), all[d].max);
      errors.plain_bytes = meshes_[first].rows.plain_bytes();
    }
    return errors;
  }

  const SourceRecord& record_;
  HeightSource& source_;
  const SourceInfo& info_;
  std::span<const MeshLayout> layouts_;
  ElevationRange range_;
  double datum_;
  Kernel kernel_;
  Prefilter prefilter_;
  std::vector<double> world_x_;     ///< of the source's columns
  std::deque<MeshGround> grounds_;  ///< [layout]
  std::deque<PlacedMesh> meshes_;   ///< [layout][placement]
  oneapi::tbb::enumerable_thread_specific<RowSampler::Scratch> scratches_;
};

}  // namespace

MeshLayout MeshLayout::squares(double spacing, bool in_full) {
  return {Kind::kOrtho, spacing, spacing, in_full};
}

MeshLayout MeshLayout::equilateral(double area) {
  const double side = std::sqrt(area / (0.5 * std::numbers::sqrt3));
  return {Kind::kIso, side, area / side, false};
}

MeshLayout MeshLayout::every(std::int64_t stride, const SourceRecord& source) {
  const auto samples = static_cast<double>(stride);
  return {Kind::kDecimated, samples * source.spacing_x, samples * source.spacing_z, false};
}

double vertex_area(const TileGrid& grid) {
  const double triangles = static_cast<double>(grid.shape().triangle_count()) * static_cast<double>(grid.tile_count());
  return grid.world_width() * grid.world_height() / (triangles / 2.0);
}

std::vector<MeshErrors> measure_meshes(const Metadata& surface, HeightSource& source,
                                       std::span<const MeshLayout> layouts, const std::string& stage, const Job& job) {
  return MeshComparison(surface, source, layouts).run(stage, job);
}

}  // namespace isohf
