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

#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/surface/resample/prefilter.h"
#include "isohf/surface/source/band_reader.h"
#include "isohf/verify/accuracy/error_statistics.h"
#include "isohf/verify/accuracy/ortho_rows.h"

namespace isohf {
namespace {

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
        datum_(choose_datum(info_, range_)),
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

  OrthoErrors run(const std::function<void(std::int64_t, std::int64_t)>& progress, const std::atomic<bool>& cancel) {
    const Prefilter as_they_are = Prefilter::make(Filter::kBilinear, {});
    BandReader samples(source_, datum_, as_they_are);
    std::optional<BandReader> coefficients;
    if (!prefilter_.is_identity()) coefficients.emplace(source_, datum_, prefilter_);
    // About as many rows of vertices whatever the spacing: memory is that of these rows and of their band.
    const auto strip = std::clamp<std::int64_t>(std::llround(32.0 * spacing_ / record_.spacing_z), 4, 64);
    for (std::int64_t first = 0; first < info_.height; first += strip) {
      if (cancel.load(std::memory_order_relaxed)) throw Error(ErrorCode::kCancelled, "interrupted");
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
      if (progress) progress(end, info_.height);
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
                               const std::function<void(std::int64_t, std::int64_t)>& progress,
                               const std::atomic<bool>& cancel) {
  return OrthoComparison(surface, source, spacing, in_full).run(progress, cancel);
}

}  // namespace isohf
