#include "raster_meshes.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/resample/row_sampler.h"
#include "isohf/sampling/source/height_rows.h"

namespace isohf::experiment {
namespace {

/// A regular mesh over an archive's ground; lengths are world units.
struct Mesh {
  bool is_iso;       ///< every second row slid by half a spacing, without the straight edges that tiles have
  double spacing_x;  ///< between neighbouring vertices of a row
  double spacing_z;  ///< between rows

  /// One vertex for each `area` of ground.
  static Mesh squares(double area) { return {false, std::sqrt(area), std::sqrt(area)}; }
  static Mesh equilateral(double area) {
    const double side = std::sqrt(area / (0.5 * std::numbers::sqrt3));
    return {true, side, area / side};
  }
};

/// Where a mesh's first vertex lies, North-West of the world's corner, in spacings.
constexpr std::array<std::array<double, 2>, 4> kPlacements = {
    {{0.125, 0.375}, {0.375, 0.875}, {0.625, 0.125}, {0.875, 0.625}}};

/// Sums of squared errors. Of squares by how they are cut: falling, rising, by least curvature, as suits the source.
struct Squares {
  std::array<double, 4> sums = {};
  std::array<double, 4> counts = {};

  void add(std::size_t cut, double square, double count = 1.0) {
    sums[cut] += square;
    counts[cut] += count;
  }
  [[nodiscard]] double rms(std::size_t cut) const { return std::sqrt(sums[cut] / std::max(counts[cut], 1.0)); }
};

/// The vertices of one square, or of two triangles of a lattice: NW, NE, SW, SE.
using Corners = std::array<double, 4>;

double blend(const Corners& heights, const Corners& weights) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 4; ++i) sum += weights[i] > 0.0 ? weights[i] * heights[i] : 0.0;
  return sum;
}

/// Both cuts, falling and rising, at (u, v) in [0, 1]. A vertex of weight 0 is not read; NaN where another is void.
std::array<double, 2> elevations_at(const Corners& h, double u, double v) {
  const double w = u + v - 1.0;
  return {blend(h, u >= v ? Corners{1.0 - u, u - v, 0.0, v} : Corners{1.0 - v, 0.0, v - u, u}),
          blend(h, w <= 0.0 ? Corners{-w, u, v, 0.0} : Corners{0.0, 1.0 - v, 1.0 - u, w})};
}

/// A mesh laid at one place: its rows of elevations, as an archive of them would give them back, and what they err by.
struct Laid {
  Mesh mesh;
  double first_x;
  double first_z;
  std::int64_t columns;
  std::vector<std::vector<double>> rows;

  /// Along which diagonal a square's vertices bend less: the sum of the absolute second differences at its two ends,
  /// along it and on to the next vertex. Where a vertex around is missing, the shorter diagonal.
  [[nodiscard]] std::size_t least_curved(std::int64_t row, std::int64_t column, const Corners& h) const {
    const auto at = [&](std::int64_t r, std::int64_t c) {
      const bool is_there = r >= 0 && r < std::ssize(rows) && c >= 0 && c < columns;
      return is_there ? rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)] : std::nan("");
    };
    const double falling =
        std::abs(at(row - 1, column - 1) - 2.0 * h[0] + h[3]) + std::abs(h[0] - 2.0 * h[3] + at(row + 2, column + 2));
    const double rising =
        std::abs(at(row + 2, column - 1) - 2.0 * h[2] + h[1]) + std::abs(h[2] - 2.0 * h[1] + at(row - 1, column + 2));
    if (!std::isnan(falling + rising)) return falling <= rising ? 0 : 1;
    return std::abs(h[0] - h[3]) > std::abs(h[1] - h[2]) ? 1 : 0;
  }
};

class Study {
 public:
  Study(const ArchiveReader& archive, HeightSource& source)
      : surface_(archive.metadata()),
        record_(surface_.source),
        datum_(choose_datum({surface_.statistics.min.value_or(0.0), surface_.statistics.max.value_or(0.0)})),
        kernel_(Kernel::make(known(surface_.filter, "filter"), known(surface_.edges, "edges"))) {
    const Window all{0, 0, record_.width, record_.height};
    const Prefilter as_they_are = Prefilter::make(Filter::kBilinear, {});
    const Prefilter prefilter = Prefilter::make(kernel_.filter(), known(surface_.acquisition, "acquisition"));
    HeightRows rows(source, datum_, false, CellStore::of_rows(source.info(), std::uint64_t{8} << 20U));
    (void)rows.read(all, as_they_are, samples_);
    (void)rows.read(all, prefilter, coefficients_);
  }

  [[nodiscard]] Squares measure(const Mesh& mesh) const {
    std::array<Squares, kPlacements.size()> found;
    oneapi::tbb::parallel_for(std::size_t{0}, found.size(),
                              [&](std::size_t i) { found[i] = compare(lay(mesh, kPlacements[i])); });
    Squares all;
    for (const Squares& one : found) {
      for (std::size_t cut = 0; cut < 4; ++cut) all.add(cut, one.sums[cut], one.counts[cut]);
    }
    return all;
  }

 private:
  [[nodiscard]] SourceAxis axis(std::int64_t samples, double first, double spacing, const Mesh& mesh) const {
    return {samples, first, spacing, record_.registration, kContinuedSteps * std::max(mesh.spacing_x, mesh.spacing_z)};
  }

  [[nodiscard]] Laid lay(const Mesh& mesh, const std::array<double, 2>& place) const {
    // Odd rows of a lattice begin half a spacing later.
    Laid laid{mesh, -(place[0] + (mesh.is_iso ? 1.0 : 0.0)) * mesh.spacing_x, -place[1] * mesh.spacing_z, 0, {}};
    laid.columns = 2 + static_cast<std::int64_t>((surface_.grid.world_width() - laid.first_x) / mesh.spacing_x);
    laid.rows.resize(2 + static_cast<std::size_t>((surface_.grid.world_height() - laid.first_z) / mesh.spacing_z));
    const SourceAxis x = axis(record_.width, record_.first_sample_x, record_.spacing_x, mesh);
    const SourceAxis z = axis(record_.height, record_.first_sample_z, record_.spacing_z, mesh);
    const CodeLimits limits = code_limits(surface_);
    const RowSampler sampler(x, z, kernel_, {limits.lowest - datum_, limits.highest - datum_});
    std::array<ColumnTaps, 2> taps;  // of even and odd rows
    for (std::size_t parity = 0; parity < taps.size(); ++parity) {
      std::vector<double> world_x;
      const double slide = mesh.is_iso ? 0.5 * static_cast<double>(parity) : 0.0;
      for (std::int64_t c = 0; c < laid.columns; ++c) {
        world_x.push_back(laid.first_x + (static_cast<double>(c) + slide) * mesh.spacing_x);
      }
      taps[parity] = make_column_taps(x, kernel_, world_x);
    }
    RowSampler::Scratch scratch;
    std::vector<float> heights(static_cast<std::size_t>(laid.columns));
    for (std::size_t row = 0; row < laid.rows.size(); ++row) {
      sampler.sample(coefficients_.view(), laid.first_z + static_cast<double>(row) * mesh.spacing_z, taps[row % 2],
                     scratch, heights);
      TileCodes codes;
      (void)quantise(surface_.quantisation, limits, datum_, heights, codes);
      laid.rows[row] = elevations_of(codes, surface_.quantisation);
    }
    return laid;
  }

  [[nodiscard]] Squares compare(const Laid& laid) const {
    const Mesh& mesh = laid.mesh;
    // The vertex at or before a place along one axis, and the share of the way to the next one.
    const auto place = [](double at, std::int64_t count) {
      const auto index = std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(at)), 0, count - 2);
      return std::pair(index, std::clamp(at - static_cast<double>(index), 0.0, 1.0));
    };
    Squares found;
    std::vector<std::array<double, 3>> open(static_cast<std::size_t>(laid.columns));  // sums of one row of squares
    const auto close = [&] {
      for (std::array<double, 3>& square : open) found.add(3, std::min(square[0], square[1]), square[2]);
      std::fill(open.begin(), open.end(), std::array<double, 3>{});
    };
    std::int64_t open_row = -1;
    for (std::int64_t r = 0; r < record_.height; ++r) {
      const double world_z = record_.first_sample_z + static_cast<double>(r) * record_.spacing_z;
      const auto [row, v] = place((world_z - laid.first_z) / mesh.spacing_z, std::ssize(laid.rows));
      if (std::exchange(open_row, row) != row) close();
      const std::vector<double>& north = laid.rows[static_cast<std::size_t>(row)];
      const std::vector<double>& south = laid.rows[static_cast<std::size_t>(row + 1)];
      // Two rows of a lattice are squares pushed over by half a spacing, East or back West; their shorter diagonal is
      // the lattice's side.
      const bool is_odd = row % 2 != 0;
      const double slide = mesh.is_iso ? 0.5 * (is_odd ? 1.0 - v : v) : 0.0;
      for (std::int64_t c = 0; c < record_.width; ++c) {
        const float sample = samples_.view().heights(c, r);
        if (std::isnan(sample)) continue;
        const double world_x = record_.first_sample_x + static_cast<double>(c) * record_.spacing_x;
        const auto [column, u] = place((world_x - laid.first_x) / mesh.spacing_x - slide, laid.columns);
        const auto i = static_cast<std::size_t>(column);
        const Corners h{north[i], north[i + 1], south[i], south[i + 1]};
        std::array<double, 2> square = elevations_at(h, u, v);
        for (double& error : square) error = std::pow(error - (double{sample} + datum_), 2);
        for (std::size_t cut = 0; cut < 2; ++cut) {
          const double error = mesh.is_iso ? square[is_odd ? 0 : 1] : square[cut];
          if (!std::isnan(error)) found.add(cut, error);
        }
        if (mesh.is_iso || std::isnan(square[0] + square[1])) continue;
        found.add(2, square[laid.least_curved(row, column, h)]);
        for (std::size_t k = 0; k < 3; ++k) open[i][k] += k < 2 ? square[k] : 1.0;
      }
    }
    close();
    return found;
  }

  const Metadata& surface_;
  const SourceRecord& record_;
  double datum_;
  Kernel kernel_;
  Band samples_;
  Band coefficients_;
};

SquareErrors errors_of(const Squares& squares) {
  return {std::min(squares.rms(0), squares.rms(1)), squares.rms(2), squares.rms(3)};
}

/// The area of a vertex at which squares err by `rms`, over `area`.
std::optional<double> area_ratio(const Study& study, double area, double twin_rms, double rms) {
  constexpr double kUsualSlope = 1.5;  // of terrain, whose rms error grows with a power of the spacing below 2
  const double farthest = std::numbers::ln2;
  std::array<double, 2> last = {0.0, std::log(twin_rms / rms)};  // log of the spacing's ratio, and of the error's
  for (int tries = 1; std::abs(last[0]) < farthest; ++tries) {
    // Further than the usual slope asks for, so that the next one encloses the target; twice as far each time.
    const double step = std::max(1.5 * std::abs(last[1]) / kUsualSlope, 0.01 * std::pow(2.0, tries));
    const double spacing = std::clamp(last[0] + (last[1] > 0.0 ? -step : step), -farthest, farthest);
    const double found = errors_of(study.measure(Mesh::squares(area * std::exp(2.0 * spacing)))).one_diagonal;
    const std::array<double, 2> next = {spacing, std::log(found / rms)};
    if ((next[1] > 0.0) != (last[1] > 0.0)) {
      return std::exp(2.0 * (last[0] - last[1] * (next[0] - last[0]) / (next[1] - last[1])));
    }
    last = next;
  }
  return std::nullopt;
}

}  // namespace

RasterComparison compare_with_squares(const ArchiveReader& archive, HeightSource& source, double iso_rms) {
  const Study study(archive, source);
  const TileGrid& grid = archive.grid();
  RasterComparison result;
  result.triangles = grid.shape().triangle_count() * grid.tile_count();
  const double area = grid.world_width() * grid.world_height() / (static_cast<double>(result.triangles) / 2.0);
  result.squares = errors_of(study.measure(Mesh::squares(area)));
  result.regular_rms = study.measure(Mesh::equilateral(area)).rms(0);
  if (std::min(iso_rms, result.squares.one_diagonal) > 0.0) {
    if (const auto ratio = area_ratio(study, area, result.squares.one_diagonal, iso_rms)) {
      result.triangles_of_equal_rms = 1.0 / *ratio;
    }
  }
  return result;
}

}  // namespace isohf::experiment
