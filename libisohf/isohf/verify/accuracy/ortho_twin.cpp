#include "isohf/verify/accuracy/ortho_twin.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
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

/// What all grids over one surface share.
struct OrthoGround {
  const Metadata& surface;
  SourceAxis axis_x;
  SourceAxis axis_z;
  Kernel kernel;
  RowSampler sampler;
  double datum;

  static OrthoGround make(const Metadata& surface, const Kernel& kernel, double datum, double spacing);
};

/// The rows of one square grid, made from North to South and kept while they are needed; elevations as an archive of
/// them would give them back.
///
///   open(z, z')     add_rows_needed     fill(0) ... fill(opened - 1), in any order, on any thread     close()
class OrthoRows {
 public:
  OrthoRows(const OrthoGround& ground, double spacing, OrthoPhase phase, bool is_coded);

  /// Drops the rows North of world_z, and makes room for those down to the first at or South of world_end; down to the
  /// end of the ground where that is infinite.
  void open(double world_z, double world_end);
  [[nodiscard]] std::int64_t opened() const { return end_row_ - filled_row_; }
  void add_rows_needed(RowRange& range) const;
  void fill(std::int64_t index, const SourceBand& band, RowSampler::Scratch& scratch);
  /// Codes what has become whole tiles. The calling thread's task arena works on them.
  void close();

  /// A place between four vertices, along one axis.
  struct Place {
    std::int64_t index;  ///< of the vertex at or before it
    double share;        ///< of the way to the next one
  };
  [[nodiscard]] Place column_at(double world_x) const { return place(world_x, first_x_, columns_); }
  [[nodiscard]] Place row_at(double world_z) const { return place(world_z, first_z_, rows_); }
  /// A row that is kept. [columns], NaN where void.
  [[nodiscard]] const double* row(std::int64_t row) const {
    return kept_[static_cast<std::size_t>(row - first_row_)].data();
  }

  [[nodiscard]] std::int64_t clamped() const { return clamped_total_; }
  [[nodiscard]] std::uint64_t plain_bytes() const { return plain_bytes_; }

 private:
  [[nodiscard]] Place place(double world, double first, std::int64_t count) const;
  void code_tiles(std::int64_t rows);

  const OrthoGround& ground_;
  double spacing_;
  double first_x_;
  double first_z_;
  std::int64_t columns_;
  std::int64_t rows_;
  ColumnTaps taps_;
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

OrthoGround OrthoGround::make(const Metadata& surface, const Kernel& kernel, double datum, double spacing) {
  const SourceRecord& source = surface.source;
  const Registration registration = source.registration;
  const Outside outside = known(surface.outside, "outside");
  const double continued = kContinuedSteps * spacing;
  const SourceAxis x(source.width, source.first_sample_x, source.spacing_x, registration, outside, continued);
  const SourceAxis z(source.height, source.first_sample_z, source.spacing_z, registration, outside, continued);
  return {surface, x, z, kernel, RowSampler(x, z, kernel, code_range(surface, datum)), datum};
}

OrthoRows::OrthoRows(const OrthoGround& ground, double spacing, OrthoPhase phase, bool is_coded)
    : ground_(ground),
      spacing_(spacing),
      first_x_(-phase.x * spacing),
      first_z_(-phase.z * spacing),
      columns_(2 + static_cast<std::int64_t>((ground.surface.grid.world_width() - first_x_) / spacing)),
      rows_(2 + static_cast<std::int64_t>((ground.surface.grid.world_height() - first_z_) / spacing)),
      is_coded_(is_coded) {
  std::vector<double> world_x(static_cast<std::size_t>(columns_));
  for (std::size_t c = 0; c < world_x.size(); ++c) world_x[c] = first_x_ + static_cast<double>(c) * spacing_;
  taps_ = make_column_taps(ground.axis_x, ground.kernel, world_x);
}

OrthoRows::Place OrthoRows::place(double world, double first, std::int64_t count) const {
  const double at = (world - first) / spacing_;
  const std::int64_t index = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(at)), 0, count - 2);
  return {index, std::clamp(at - static_cast<double>(index), 0.0, 1.0)};
}

void OrthoRows::open(double world_z, double world_end) {
  const std::int64_t first = row_at(world_z).index;
  end_row_ = std::max(end_row_, std::isinf(world_end) ? rows_ : row_at(world_end).index + 2);
  while (!kept_.empty() && first_row_ < first) {
    kept_.pop_front();
    ++first_row_;
  }
  kept_.resize(static_cast<std::size_t>(end_row_ - first_row_));
  clamped_.assign(static_cast<std::size_t>(opened()), 0);
  if (is_coded_) codes_.resize(codes_.size() + clamped_.size());
}

void OrthoRows::add_rows_needed(RowRange& range) const {
  for (std::int64_t row = filled_row_; row < end_row_; ++row) {
    ground_.sampler.add_rows_needed(first_z_ + static_cast<double>(row) * spacing_, range);
  }
}

void OrthoRows::fill(std::int64_t index, const SourceBand& band, RowSampler::Scratch& scratch) {
  const std::int64_t row = filled_row_ + index;
  std::vector<float> heights(static_cast<std::size_t>(columns_));
  ground_.sampler.sample(band, first_z_ + static_cast<double>(row) * spacing_, taps_, scratch, heights);
  TileCodes codes;
  const Quantisation& quantisation = ground_.surface.quantisation;
  const QuantiserCounts counts = quantise(quantisation, code_limits(ground_.surface), ground_.datum, heights, codes);
  clamped_[static_cast<std::size_t>(index)] = counts.below + counts.above;
  kept_[static_cast<std::size_t>(row - first_row_)] = elevations_of(codes, quantisation);
  if (is_coded_) codes_[codes_.size() - static_cast<std::size_t>(opened() - index)] = std::move(codes);
}

void OrthoRows::close() {
  filled_row_ = end_row_;
  for (const std::int64_t count : clamped_) clamped_total_ += count;
  while (static_cast<std::int64_t>(codes_.size()) >= kTileSide) code_tiles(kTileSide);
  if (end_row_ == rows_ && !codes_.empty()) code_tiles(static_cast<std::int64_t>(codes_.size()));
}

void OrthoRows::code_tiles(std::int64_t rows) {
  // As many rows and columns as the ground holds spacings: the next ground's first vertices are not this one's.
  const auto spacings = [&](double length) { return std::max(std::llround(length / spacing_), 1LL); };
  const std::int64_t columns = std::min<std::int64_t>(spacings(ground_.surface.grid.world_width()), columns_);
  const std::int64_t wanted = spacings(ground_.surface.grid.world_height()) - coded_rows_;
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

constexpr std::size_t kPhases = std::size(kOrthoPhases);
using SumsOfRow = std::array<std::array<ErrorSums, 2>, kPhases>;  ///< [phase][diagonal]
using Histograms = std::array<ErrorHistogram, 2>;                 ///< [diagonal]

/// The elevations of one square's vertices: West to East, the North ones first.
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

class OrthoComparison {
 public:
  OrthoComparison(const Metadata& surface, HeightSource& source, double spacing, bool in_full)
      : record_(surface.source),
        source_(source),
        info_(source.info()),
        spacing_(spacing),
        range_{surface.statistics.min.value_or(0.0), surface.statistics.max.value_or(0.0)},
        datum_(choose_datum(range_)),
        kernel_(Kernel::make(known(surface.filter, "filter"), known(surface.edges, "edges"))),
        prefilter_(Prefilter::make(kernel_.filter(), known(surface.acquisition, "acquisition"), kernel_.edges())),
        ground_(OrthoGround::make(surface, kernel_, datum_, spacing)),
        in_full_(in_full) {
    for (const OrthoPhase& phase : kOrthoPhases) {
      phases_.emplace_back(ground_, spacing, phase, in_full && phases_.empty());
      std::vector<OrthoRows::Place>& columns = columns_.emplace_back(static_cast<std::size_t>(info_.width));
      for (std::size_t c = 0; c < columns.size(); ++c) {
        columns[c] = phases_.back().column_at(record_.first_sample_x + static_cast<double>(c) * record_.spacing_x);
      }
    }
  }

  OrthoErrors run(const std::string& stage, const Job& job) {
    const Prefilter as_they_are = Prefilter::make(Filter::kBilinear, {});
    BandReader samples(source_, datum_, as_they_are);
    std::optional<BandReader> coefficients;
    if (!prefilter_.is_identity()) coefficients.emplace(source_, datum_, prefilter_);
    // About as many rows of vertices whatever the spacing: memory is that of these rows and of their band.
    const auto strip = std::clamp<std::int64_t>(std::llround(32.0 * spacing_ / record_.spacing_z), 4, 64);
    for (std::int64_t first = 0; first < info_.height; first += strip) {
      job.throw_if_cancelled();
      const std::int64_t end = std::min(first + strip, info_.height);
      const bool is_last = end == info_.height;
      RowRange rows = RowSampler::no_rows();
      for (OrthoRows& phase : phases_) {
        phase.open(world_z(first), is_last ? std::numeric_limits<double>::infinity() : world_z(end - 1));
        phase.add_rows_needed(rows);
      }
      const RowRange compared{first, end - 1};
      if (coefficients) {
        if (rows.first <= rows.last) fill_phases(*coefficients->read(rows));
        compare_rows(*samples.read(compared), first, end);
      } else {
        const auto band = samples.read({std::min(rows.first, first), std::max(rows.last, end - 1)});
        fill_phases(*band);
        compare_rows(*band, first, end);
      }
      job.report({stage, "rows", end, info_.height});
    }
    return result();
  }

 private:
  [[nodiscard]] double world_x(std::size_t column) const {
    return record_.first_sample_x + static_cast<double>(column) * record_.spacing_x;
  }
  [[nodiscard]] double world_z(std::int64_t row) const {
    return record_.first_sample_z + static_cast<double>(row) * record_.spacing_z;
  }

  void fill_phases(const Band& band) {
    std::vector<std::pair<std::size_t, std::int64_t>> rows;
    for (std::size_t p = 0; p < kPhases; ++p) {
      for (std::int64_t i = 0; i < phases_[p].opened(); ++i) rows.emplace_back(p, i);
    }
    const SourceBand view = band.view();
    oneapi::tbb::parallel_for(std::size_t{0}, rows.size(), [&](std::size_t i) {
      phases_[rows[i].first].fill(rows[i].second, view, scratches_.local());
    });
    for (OrthoRows& phase : phases_) phase.close();
  }

  void compare_rows(const Band& band, std::int64_t first, std::int64_t end) {
    std::vector<SumsOfRow> sums(static_cast<std::size_t>(end - first));
    oneapi::tbb::parallel_for(first, end, [&](std::int64_t row) {
      const float* const samples = band.view().heights.row(row - band.rows.first);
      for (std::size_t p = 0; p < kPhases; ++p) {
        compare_row(samples, row, p, sums[static_cast<std::size_t>(row - first)][p]);
      }
    });
    for (const SumsOfRow& row : sums) {
      for (std::size_t p = 0; p < kPhases; ++p) {
        for (std::size_t d = 0; d < 2; ++d) sums_[p][d].add(row[p][d]);
      }
    }
  }

  void compare_row(const float* samples, std::int64_t row, std::size_t p, std::array<ErrorSums, 2>& sums) {
    const OrthoRows& phase = phases_[p];
    const OrthoRows::Place place = phase.row_at(world_z(row));
    const double* const north = phase.row(place.index);
    const double* const south = phase.row(place.index + 1);
    Histograms* const histograms = in_full_ ? &histograms_.local() : nullptr;
    for (std::size_t c = 0; c < columns_[p].size(); ++c) {
      if (std::isnan(samples[c])) continue;
      const double expected = double{samples[c]} + datum_;
      const auto [i, u] = columns_[p][c];
      const Square square{{north[i], north[i + 1], south[i], south[i + 1]}};
      const std::array<double, 2> found = square.at(u, place.share);
      for (std::size_t d = 0; d < 2; ++d) {
        const double error = std::abs(found[d] - expected);
        if (std::isnan(error)) continue;
        sums[d].add(error, {});
        if (histograms != nullptr) (*histograms)[d].add(error);
      }
    }
  }

  OrthoErrors result() const {
    std::array<ErrorSums, 2> all{};
    std::array<double, 2> max{};
    for (std::size_t p = 0; p < kPhases; ++p) {
      for (std::size_t d = 0; d < 2; ++d) {
        all[d].add(sums_[p][d]);
        max[d] += sums_[p][d].max / static_cast<double>(kPhases);
      }
    }
    const std::size_t best = all[1].rms() < all[0].rms() ? 1 : 0;
    OrthoErrors errors;
    errors.spacing = spacing_;
    const TileGrid& grid = ground_.surface.grid;
    errors.vertices = std::llround(grid.world_width() / spacing_ * (grid.world_height() / spacing_));
    errors.compared = all[best].count / static_cast<std::int64_t>(kPhases);
    errors.diagonal = best == 0 ? Diagonal::kFalling : Diagonal::kRising;
    errors.rms = all[best].rms();
    errors.rms_of_other = all[1 - best].rms();
    errors.max = max[best];
    ErrorHistogram histogram;
    for (const Histograms& part : histograms_) histogram.add(part[best]);
    errors.p99 = std::min(histogram.percentile(0.99), all[best].max);
    errors.psnr_db = psnr_db(range_.max - range_.min, errors.rms);
    errors.clamped = phases_.front().clamped();
    errors.plain_bytes = phases_.front().plain_bytes();
    return errors;
  }

  const SourceRecord& record_;
  HeightSource& source_;
  const SourceInfo& info_;
  double spacing_;
  ElevationRange range_;
  double datum_;
  Kernel kernel_;
  Prefilter prefilter_;
  OrthoGround ground_;
  bool in_full_;
  std::deque<OrthoRows> phases_;  ///< as kOrthoPhases; the first is coded
  std::vector<std::vector<OrthoRows::Place>> columns_;
  SumsOfRow sums_{};
  oneapi::tbb::enumerable_thread_specific<RowSampler::Scratch> scratches_;
  oneapi::tbb::enumerable_thread_specific<Histograms> histograms_;
};

}  // namespace

double ortho_spacing(const TileGrid& grid) {
  const double triangles = static_cast<double>(grid.shape().triangle_count()) * static_cast<double>(grid.tile_count());
  return std::sqrt(grid.world_width() * grid.world_height() / (triangles / 2.0));
}

OrthoErrors measure_ortho_twin(const Metadata& surface, HeightSource& source, double spacing, bool in_full,
                               const std::string& stage, const Job& job) {
  return OrthoComparison(surface, source, spacing, in_full).run(stage, job);
}

}  // namespace isohf
