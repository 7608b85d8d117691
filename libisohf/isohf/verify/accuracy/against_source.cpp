#include <fmt/format.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/metadata/cut_record.h"
#include "isohf/base/arena.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/restore/rows/vertex_rows.h"
#include "isohf/sampling/source/height_rows.h"
#include "isohf/sampling/source/source_statistics.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "isohf/verify/accuracy/error_statistics.h"
#include "isohf/verify/accuracy/same_source.h"

namespace isohf {
namespace {

/// What one run of samples adds up to; sums are formed run by run in a fixed order.
struct Sums {
  AccuracyReport counts;
  ErrorSums errors;
  std::int64_t worst_column = 0;
  std::int64_t visited = 0;
};

/// Source samples that are looked at together: either side of a square.
constexpr std::int64_t kBlock = 32;
/// Samples around one that are searched for voids, at most: next to a pole a triangle reaches over any number.
constexpr std::int64_t kMostReach = 64;
constexpr std::size_t kMostPeaks = 256;
/// Of the source: in one read, and of the windows that are kept.
constexpr std::uint64_t kReadBytes = std::uint64_t{8} << 20U;
constexpr std::uint64_t kWindowsBytes = std::uint64_t{128} << 20U;
/// Object coordinates this near to a vertex's are the vertex's: places are rounded, and next to a void it matters.
constexpr double kOnVertex = 1e-7;

/// Whether a map shows the place of a sample.
bool is_shown(WorldPoint world) {
  return std::isfinite(world.x) && std::isfinite(world.z);
}

double snapped(double object) {
  const double whole = std::round(object);
  return std::abs(object - whole) < kOnVertex ? whole : object;
}

/// Leaves the largest.
void prune(std::vector<ErrorPeak>& peaks) {
  std::sort(peaks.begin(), peaks.end(), [](const ErrorPeak& a, const ErrorPeak& b) {
    return a.error != b.error ? a.error > b.error : a.row < b.row;
  });
  peaks.resize(std::min(peaks.size(), kMostPeaks));
}

/// A row of tiles, decoded, where samples lie anywhere on it.
struct TileRowSurface {
  std::int64_t tile_row = 0;
  std::vector<std::vector<double>> elevations;
};

/// Samples of the source that are compared at once, about, where they lie in rows.
constexpr std::int64_t kSamplesAtOnce = std::int64_t{1} << 20U;

class Comparison {
 public:
  Comparison(const ArchiveReader& archive, HeightSource& source)
      : archive_(archive),
        grid_(archive.grid()),
        record_(archive.metadata().source),
        source_(source),
        info_(source.info()),
        is_cut_(is_cut(archive.metadata())) {
    (void)check_same_source(archive, info_);
    const Statistics& statistics = archive.metadata().statistics;
    const ElevationRange range{statistics.min.value_or(0.0), statistics.max.value_or(0.0)};
    datum_ = choose_datum(range);
    span_ = range.max - range.min;
    const double reach = std::max(grid_.sigma_x() * 2.0 / record_.spacing_x, grid_.sigma_z() / record_.spacing_z);
    reach_ = static_cast<std::int64_t>(std::ceil(reach)) + 1;
    if (is_warped(archive.metadata())) warp_.emplace(*archive_geometry(archive.metadata()).warp);
    rows_at_once_ =
        std::max<std::int64_t>(kSamplesAtOnce / info_.width, 2 * oneapi::tbb::this_task_arena::max_concurrency());
  }

  AccuracyReport run(const Job& job) {
    const ScratchFolder scratch = choose_memory(job);
    HeightRows rows(source_, datum_, false,
                    warp_ ? CellStore::of_windows(info_, kWindowsBytes, job.scratch_folder)
                          : CellStore::of_rows(info_, kReadBytes));
    AccuracyReport report;
    ErrorSums errors;
    std::int64_t first_row = 0;
    if (warp_) run_warped(rows, report, errors, job);
    VertexRows tiles(grid_, archive_.metadata().quantisation, tiles_of(archive_), 0, grid_.tile_columns() - 1, scratch);
    for (std::int64_t tile_row = 0; !warp_ && tile_row < grid_.tile_rows() && first_row < info_.height; ++tile_row) {
      const std::int64_t end_row = rows_until(tile_row);
      if (end_row > first_row) {
        tiles.drop_before(tile_row);
        tiles.have(tile_row);
      }
      while (first_row < end_row) {
        job.throw_if_cancelled();
        const std::int64_t end = std::min(first_row + rows_at_once_, end_row);
        const std::int64_t first = std::max<std::int64_t>(first_row - 2 * reach_, 0);
        Band band;
        rows.drop_before(first);
        (void)rows.read({0, first, info_.width, std::min(end + 2 * reach_, info_.height) - first}, as_they_are_, band);
        compare_rows(RowSurface{tiles, tile_row}, band, first_row, end, report, errors);
        first_row = end;
      }
      job.report({"compare", "rows", tile_row + 1, grid_.tile_rows()});
    }
    report.samples = info_.width * info_.height;
    report.samples_compared = errors.count;
    report.rms = errors.rms();
    report.max = errors.max;
    report.worst = errors.worst;
    report.psnr_db = psnr_db(span_, report.rms);
    ErrorHistogram histogram;
    for (const ErrorHistogram& part : histograms_) histogram.add(part);
    prune(report.peaks);
    report.p99 = std::min(histogram.percentile(0.99), report.max);
    return report;
  }

 private:
  [[nodiscard]] double world_x(double column) const { return record_.first_sample_x + column * record_.spacing_x; }
  [[nodiscard]] double world_z(double row) const { return record_.first_sample_z + row * record_.spacing_z; }

  /// A row of tiles, where samples lie in rows of its own.
  struct RowSurface {
    const VertexRows& tiles;
    std::int64_t tile_row;
  };

  /// Where a row of tiles is kept. Throws Error{kOutOfMemory}.
  ScratchFolder choose_memory(const Job& job) {
    if (job.bound_bytes() == 0) return std::nullopt;
    const auto width = static_cast<double>(info_.width);
    const double tiles = VertexRows::memory_bytes(grid_, 0.0);
    // Of projected samples windows are kept, and the row's tiles as doubles.
    const double rows = static_cast<double>(rows_at_once_ + 4 * reach_ + 4) * width * 10.0;
    const double bytes = reading_bytes(job, static_cast<double>(grid_.shape().stored_vertex_count())) +
                         static_cast<double>(source_.buffer_bytes()) + 2.0 * kReadBytes +
                         (warp_ ? static_cast<double>(kWindowsBytes) : rows) +
                         threads_of(job) * 8.0 * static_cast<double>(grid_.tile_columns() * grid_.shape().columns()) +
                         (warp_ ? 2.0 * tiles : 0.0);
    return scratch_for(job, bytes + tiles, bytes, "comparing");
  }

  /// Whether a place is on tiles that were not extracted.
  [[nodiscard]] bool is_elsewhere(WorldPoint world) const {
    return is_cut_ &&
           !(world.x >= 0.0 && world.x <= grid_.world_width() && world.z >= 0.0 && world.z <= grid_.world_height());
  }

  /// The tile row under a world place; the nearest one for places beside the tiles.
  [[nodiscard]] std::int64_t tile_row_at(WorldPoint world) const {
    const double row = std::floor(world.z / grid_.extent_z());
    return static_cast<std::int64_t>(std::clamp(row, 0.0, static_cast<double>(grid_.tile_rows() - 1)));
  }

  /// The source was projected: each sample has a place of its own, and is compared with the tile row that it lies on.
  void run_warped(HeightRows& rows, AccuracyReport& report, ErrorSums& errors, const Job& job) {
    const std::vector<SourceWarp::RowBounds> all = SourceWarp(grid_, warp_->place(), 0.0).reading_bounds();
    visited_ = 0;
    for (std::int64_t tile_row = 0; tile_row < grid_.tile_rows(); ++tile_row) {
      job.throw_if_cancelled();
      const SourceWarp::RowBounds& bounds = all[static_cast<std::size_t>(tile_row)];
      const auto last = static_cast<double>(info_.height - 1);
      if (bounds.most >= 0.0 && bounds.least <= last) {
        const auto first_row = static_cast<std::int64_t>(std::max(std::floor(bounds.least), 0.0));
        const auto end_row = static_cast<std::int64_t>(std::min(std::ceil(bounds.most), last)) + 1;
        rows.drop_before(first_row - kMostReach);
        compare_rows(decode(tile_row), rows, first_row, end_row, report, errors);
      }
      job.report({"compare", "rows", tile_row + 1, grid_.tile_rows()});
    }
    // Each of the others was visited on one tile row.
    if (!is_cut_) report.samples_off_map = info_.width * info_.height - visited_;
  }

  /// One past the last source row that lies North of the tile row's South edge; all that are left, for the last row.
  [[nodiscard]] std::int64_t rows_until(std::int64_t tile_row) const {
    if (tile_row + 1 == grid_.tile_rows()) return info_.height;
    const double edge = static_cast<double>(tile_row + 1) * grid_.extent_z();
    const double rows = std::ceil((edge - record_.first_sample_z) / record_.spacing_z);
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(rows), 0, info_.height);
  }

  TileRowSurface decode(std::int64_t tile_row) const {
    TileRowSurface surface;
    surface.tile_row = tile_row;
    surface.elevations.resize(static_cast<std::size_t>(grid_.tile_columns()));
    oneapi::tbb::parallel_for(std::size_t{0}, surface.elevations.size(), [&](std::size_t column) {
      surface.elevations[column] = archive_.read_elevations({static_cast<std::int64_t>(column), tile_row});
    });
    return surface;
  }

  [[nodiscard]] TilePoint locate(std::int64_t tile_row, WorldPoint world) const {
    TilePoint at = grid_.locate(world);
    // A source row on the edge of two tile rows may be rounded to either; their vertices on it are the same.
    if (at.tile.row > tile_row) at.point.z = grid_.shape().cell_rows();
    if (at.tile.row < tile_row) at.point.z = 0.0;
    at.point = {snapped(at.point.x), snapped(at.point.z)};
    return at;
  }

  [[nodiscard]] double elevation_at(const TileRowSurface& surface, WorldPoint world) const {
    // A projected source lies on the tiles as a whole: what does not is none of theirs.
    constexpr double kOnTheEdge = 0.01;  // of a tile
    const auto is_beside = [](double at, double end, double extent) {
      return !(std::abs(std::clamp(at, 0.0, end) - at) <= kOnTheEdge * extent);
    };
    if (is_beside(world.x, grid_.world_width(), grid_.extent_x()) ||
        is_beside(world.z, grid_.world_height(), grid_.extent_z())) {
      return NAN;
    }
    const TilePoint at = locate(surface.tile_row, world);
    const std::vector<double>& elevations = surface.elevations[static_cast<std::size_t>(at.tile.column)];
    const View2D<const double> view(elevations.data(), grid_.shape().columns(), grid_.shape().rows());
    return interpolate(snapped(barycentric(grid_.shape(), at.point)), view);
  }

  void compare_rows(const TileRowSurface& surface, HeightRows& rows, std::int64_t first, std::int64_t end,
                    AccuracyReport& report, ErrorSums& errors) {
    std::vector<Sums> sums(static_cast<std::size_t>(end - first));
    oneapi::tbb::parallel_for(first / kBlock, (end + kBlock - 1) / kBlock, [&](std::int64_t block) {
      const std::int64_t from = std::max(first, block * kBlock);
      const std::int64_t to = std::min(end, (block + 1) * kBlock);
      compare_warped_rows(surface, rows, from, to, std::span(sums).subspan(static_cast<std::size_t>(from - first)));
    });
    add_up(sums, first, report, errors);
  }

  void compare_rows(const RowSurface& surface, const Band& band, std::int64_t first, std::int64_t end,
                    AccuracyReport& report, ErrorSums& errors) {
    std::vector<Sums> sums(static_cast<std::size_t>(end - first));
    oneapi::tbb::parallel_for(first, end, [&](std::int64_t row) {
      compare_row(surface, band, row, sums[static_cast<std::size_t>(row - first)], histograms_.local());
    });
    add_up(sums, first, report, errors);
  }

  void add_up(std::span<const Sums> sums, std::int64_t first, AccuracyReport& report, ErrorSums& errors) {
    for (std::size_t i = 0; i < sums.size(); ++i) {
      const Sums& row = sums[i];
      if (row.errors.max > 0.0) {
        report.peaks.push_back({row.errors.max, row.worst_column, first + static_cast<std::int64_t>(i)});
        if (report.peaks.size() > 64 * kMostPeaks) prune(report.peaks);
      }
      visited_ += row.visited;
      errors.add(row.errors);
      report.samples_void += row.counts.samples_void;
      report.samples_lost += row.counts.samples_lost;
      report.lost_inside += row.counts.lost_inside;
      report.samples_invented += row.counts.samples_invented;
      report.invented_inside += row.counts.invented_inside;
    }
  }

  void compare_row(const RowSurface& surface, const Band& band, std::int64_t row, Sums& sums,
                   ErrorHistogram& histogram) const {
    const double z = world_z(static_cast<double>(row));
    const TriangleRows vertices(surface.tiles, grid_.shape(), surface.tile_row,
                                locate(surface.tile_row, {0.0, z}).point.z, 0, grid_.tile_columns());
    for (std::int64_t column = 0; column < info_.width; ++column) {
      const WorldPoint world{world_x(static_cast<double>(column)), z};
      if (is_elsewhere(world)) continue;
      const TilePoint at = locate(surface.tile_row, world);
      const double stored = vertices.elevation(archive_.metadata().quantisation, at.tile.column,
                                               snapped(barycentric(grid_.shape(), at.point)));
      compare_sample(stored, band, column, row, world, sums, histogram);
    }
  }

  void compare_sample(double stored, const Band& band, std::int64_t column, std::int64_t row, WorldPoint world,
                      Sums& sums, ErrorHistogram& histogram) const {
    const float sample = band.view().heights(column - band.window.column, row - band.window.row);
    const bool is_void = std::isnan(sample);
    sums.counts.samples_void += is_void ? 1 : 0;
    if (is_void || std::isnan(stored)) {
      if (is_void != std::isnan(stored)) count_mismatch(band, column, row, is_void, sums.counts);
      return;
    }
    const double error = std::abs(stored - (double{sample} + datum_));
    if (error > sums.errors.max) sums.worst_column = column;
    sums.errors.add(error, world);
    histogram.add(error);
  }

  /// Those samples of rows [first, end), a block's rows at most, that lie on the surface's tile row.
  void compare_warped_rows(const TileRowSurface& surface, HeightRows& rows, std::int64_t first, std::int64_t end,
                           std::span<Sums> sums) {
    ErrorHistogram& histogram = histograms_.local();
    Band band;
    for (std::int64_t column = 0; column < info_.width; column += kBlock) {
      const std::int64_t end_column = std::min(column + kBlock, info_.width);
      if (!may_meet(surface.tile_row, column, end_column, first, end)) continue;
      const std::int64_t west = std::max<std::int64_t>(column - kMostReach, 0);
      const std::int64_t north = std::max<std::int64_t>(first - kMostReach, 0);
      const Window around{west, north, std::min(end_column + kMostReach, info_.width) - west,
                          std::min(end + kMostReach, info_.height) - north};
      (void)rows.read(around, as_they_are_, band);
      for (std::int64_t row = first; row < end; ++row) {
        Sums& of_row = sums[static_cast<std::size_t>(row - first)];
        for (std::int64_t c = column; c < end_column; ++c) {
          const WorldPoint world = warp_->world_from_source({static_cast<double>(c), static_cast<double>(row)});
          if (!is_shown(world) || tile_row_at(world) != surface.tile_row) continue;
          ++of_row.visited;
          if (is_elsewhere(world)) continue;
          compare_sample(elevation_at(surface, world), band, c, row, world, of_row, histogram);
        }
      }
    }
  }

  /// False where a block of samples surely lies on other tile rows: its place is known at nine of them, and bends
  /// between these by less than half as much as it changes over the block.
  [[nodiscard]] bool may_meet(std::int64_t tile_row, std::int64_t column, std::int64_t end_column, std::int64_t row,
                              std::int64_t end_row) const {
    double least = HUGE_VAL;
    double most = -HUGE_VAL;
    for (const double t : {0.0, 0.5, 1.0}) {
      for (const double s : {0.0, 0.5, 1.0}) {
        const double u = static_cast<double>(column) + s * static_cast<double>(end_column - 1 - column);
        const double v = static_cast<double>(row) + t * static_cast<double>(end_row - 1 - row);
        const WorldPoint world = warp_->world_from_source({u, v});
        if (!is_shown(world)) return true;  // on the map's outline
        const double z = world.z;
        least = std::min(least, z);
        most = std::max(most, z);
      }
    }
    const double margin = 0.5 * (most - least) + grid_.sigma_z();
    return tile_row_at({0.0, least - margin}) <= tile_row && tile_row_at({0.0, most + margin}) >= tile_row;
  }

  /// Whether the world's map ends within a triangle's reach of a sample, as at the outline of a map of the whole body.
  [[nodiscard]] bool is_on_outline(std::int64_t column, std::int64_t row) const {
    if (!warp_) return false;
    const WorldPoint world = warp_->world_from_source({static_cast<double>(column), static_cast<double>(row)});
    for (const double x : {-2.0 * grid_.sigma_x(), 0.0, 2.0 * grid_.sigma_x()}) {
      for (const double z : {-grid_.sigma_z(), 0.0, grid_.sigma_z()}) {
        if (std::isnan(warp_->source_from_world({world.x + x, world.z + z}).u)) return true;
      }
    }
    return false;
  }

  /// Samples that a triangle may reach over from this one.
  [[nodiscard]] std::int64_t reach_at(std::int64_t column, std::int64_t row) const {
    if (!warp_) return reach_;
    const SourcePosition here{static_cast<double>(column), static_cast<double>(row)};
    const WorldPoint world = warp_->world_from_source(here);
    double most = 0.0;
    for (const double side : {-1.0, 1.0}) {
      for (const auto& [x, z] :
           {std::pair{2.0 * side * grid_.sigma_x(), 0.0}, std::pair{0.0, side * grid_.sigma_z()}}) {
        const SourcePosition there = warp_->source_from_world({world.x + x, world.z + z});
        most = std::max({most, std::abs(std::remainder(there.u - here.u, warp_->place().columns_round())),
                         std::abs(there.v - here.v)});
      }
    }
    return std::min(static_cast<std::int64_t>(std::ceil(1.5 * most)) + 1, kMostReach);
  }

  /// A sample that has an elevation on one side only. Around voids that is as it should be: a triangle with a void
  /// vertex is no surface. It is a fault where the neighbourhood within a triangle's reach is all of one kind.
  void count_mismatch(const Band& band, std::int64_t column, std::int64_t row, bool void_in_source,
                      AccuracyReport& counts) const {
    ++(void_in_source ? counts.samples_invented : counts.samples_lost);
    if (!void_in_source && is_on_outline(column, row)) return;
    // A void may be on a triangle whose corners lie beside samples, each as far from one again.
    const std::int64_t reach =
        std::min((void_in_source ? 2 : 1) * reach_at(column, row), warp_ ? kMostReach : 2 * reach_);
    for (std::int64_t r = row - reach; r <= row + reach; ++r) {
      for (std::int64_t c = column - reach; c <= column + reach; ++c) {
        const bool inside = c >= 0 && r >= 0 && c < info_.width && r < info_.height;
        if (inside && std::isnan(band.view().heights(c - band.window.column, r - band.window.row)) != void_in_source)
          return;
      }
    }
    ++(void_in_source ? counts.invented_inside : counts.lost_inside);
  }

  const ArchiveReader& archive_;
  const TileGrid& grid_;
  const SourceRecord& record_;
  HeightSource& source_;
  const SourceInfo& info_;
  const bool is_cut_;
  const Prefilter as_they_are_ = Prefilter::make(Filter::kBilinear, {});
  double datum_ = 0.0;
  double span_ = 0.0;
  std::int64_t reach_ = 2;
  std::int64_t rows_at_once_ = 1;  ///< that are compared, where samples lie in rows
  std::optional<ExactWarp> warp_;  ///< where the source was projected
  std::int64_t visited_ = 0;
  oneapi::tbb::enumerable_thread_specific<ErrorHistogram> histograms_;
};

}  // namespace

AccuracyReport compare_with_source(const ArchiveReader& archive, HeightSource& source, const Job& job) {
  AccuracyReport report;
  Arena(job).execute([&] { report = Comparison(archive, source).run(job); });
  return report;
}

std::string contradiction(const Metadata& metadata, const AccuracyReport& found) {
  const std::optional<AccuracyInfo> stated = accuracy_info(metadata);
  if (!stated) return {};
  // The reference of the heights' floats may be another one.
  const Statistics& statistics = metadata.statistics;
  const double largest = std::max(std::abs(statistics.min.value_or(0.0)), std::abs(statistics.max.value_or(0.0)));
  const double tolerance = 1e-6 * largest + 1e-9;
  if (stated->compared == found.samples_compared && stated->lost == found.samples_lost &&
      std::abs(stated->max - found.max) <= tolerance && std::abs(stated->rms - found.rms) <= tolerance) {
    return {};
  }
  return fmt::format(
      "the metadata state an error of rms {:.6g}, at most {:.6g}, over {} samples, {} lost; found are rms {:.6g}, at "
      "most "
      "{:.6g}, {} samples, {} lost",
      stated->rms, stated->max, stated->compared, stated->lost, found.rms, found.max, found.samples_compared,
      found.samples_lost);
}

}  // namespace isohf
