#include "isohf/verify/accuracy/lattice_report.h"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "isohf/base/arena.h"
#include "isohf/verify/accuracy/plain_coding.h"

namespace isohf {
namespace {

/// A tile's visible vertices without those of its last row and of its rows' ends, which its neighbours have as well.
std::uint64_t plain_bytes_of_tile(const TileShape& shape, const TileCodes& tile) {
  TileCodes visible;
  visible.type = tile.type;
  std::vector<std::int64_t> widths;
  for (int r = 1; r <= shape.cell_rows(); ++r) {
    const int width = shape.cell_columns() + (r % 2 == 0 ? 1 : 0);  // even rows have a slid vertex at either end
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(r) * shape.columns() + 1;
    if (tile.type == CodeType::kF32) {
      visible.heights.insert(visible.heights.end(), tile.heights.begin() + first, tile.heights.begin() + first + width);
    } else {
      visible.codes.insert(visible.codes.end(), tile.codes.begin() + first, tile.codes.begin() + first + width);
    }
    widths.push_back(width);
  }
  return plainly_coded_bytes(visible, widths);
}

void measure_archive(const ArchiveReader& archive, LatticeReport& report, const Job& job) {
  const TileGrid& grid = archive.grid();
  report.triangles = grid.shape().triangle_count() * grid.tile_count();
  report.vertices = report.triangles / 2;
  std::vector<std::uint64_t> bytes(static_cast<std::size_t>(grid.tile_columns()));
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    job.throw_if_cancelled();
    oneapi::tbb::parallel_for(std::size_t{0}, bytes.size(), [&](std::size_t column) {
      const TileCodes tile = archive.read_tile({static_cast<std::int64_t>(column), row});
      bytes[column] = plain_bytes_of_tile(grid.shape(), tile);
    });
    for (std::size_t column = 0; column < bytes.size(); ++column) {
      report.plain_bytes += bytes[column];
      report.tile_bytes += archive.tile_entry({static_cast<std::int64_t>(column), row}).compressed_bytes;
    }
  }
}

/// Looks for the spacing at which the ortho mesh errs by a given rms, on logarithmic scales.
class SpacingSearch {
 public:
  explicit SpacingSearch(double rms) : target_(std::log(rms)) {}

  void add(double spacing_ratio, double rms) {
    const Point point{std::log(spacing_ratio), std::log(rms) - target_};
    points_.insert(std::upper_bound(points_.begin(), points_.end(), point,
                                    [](const Point& a, const Point& b) { return a.spacing < b.spacing; }),
                   point);
  }

  /// Where the error is met between two measured ratios, by interpolation.
  [[nodiscard]] std::optional<double> found() const {
    for (std::size_t i = 1; i < points_.size(); ++i) {
      const Point& a = points_[i - 1];
      const Point& b = points_[i];
      if (a.error <= 0.0 && b.error >= 0.0 && b.error > a.error) {
        return std::exp(a.spacing - a.error * (b.spacing - a.spacing) / (b.error - a.error));
      }
    }
    return std::nullopt;
  }

  /// The ratio to try next while nothing is found; nullopt where the ends of what is tried leave the error outside.
  [[nodiscard]] std::optional<double> next() const {
    const Point& end = points_.front().error > 0.0 ? points_.front() : points_.back();
    if (std::abs(end.spacing) >= kFarthest) return std::nullopt;
    // Further than the usual slope asks for, so that the next one encloses the target; twice as far each time where it
    // does not: errors of rounding hardly change with the spacing.
    const double shortest = kShortestStep * std::pow(2.0, static_cast<double>(points_.size()));
    const double step = std::max(1.5 * std::abs(end.error) / kUsualSlope, shortest);
    const double next = end.error > 0.0 ? end.spacing - step : end.spacing + step;
    return std::exp(std::clamp(next, -kFarthest, kFarthest));
  }

 private:
  struct Point {
    double spacing;  ///< log of the ratio to the twin's
    double error;    ///< log of rms over the target
  };
  static constexpr double kUsualSlope = 1.5;  ///< of terrain, whose rms error grows with a power of the spacing below 2
  static constexpr double kShortestStep = 0.01;
  static constexpr double kFarthest = 0.6931471805599453;  ///< log 2: four times the vertices, or a quarter

  double target_;
  std::vector<Point> points_;  ///< by spacing
};

/// Errors of no more than this are arithmetic, not terrain: half a unit in the last place of a float of that size.
double rounding_of(const Metadata& metadata) {
  const Statistics& statistics = metadata.statistics;
  return 0x1p-24 * std::max(std::abs(statistics.min.value_or(0.0)), std::abs(statistics.max.value_or(0.0)));
}

void compare(const ArchiveReader& archive, HeightSource& source, double iso_rms, LatticeReport& report,
             const Job& job) {
  measure_archive(archive, report, job);
  const Metadata& metadata = archive.metadata();
  const SourceRecord& record = metadata.source;
  int pass = 0;
  const auto measure = [&](std::span<const MeshLayout> layouts) {
    return measure_meshes(metadata, source, layouts, "ortho " + std::to_string(++pass), job);
  };
  const auto measure_squares = [&](double spacing, bool in_full) {
    return measure(std::array{MeshLayout::squares(spacing, in_full)}).front();
  };
  const double area = vertex_area(archive.grid());
  const double spacing = std::sqrt(area);
  const std::int64_t stride = std::llround(std::sqrt(area / (record.spacing_x * record.spacing_z)));
  std::vector<MeshLayout> layouts{MeshLayout::squares(spacing, true), MeshLayout::equilateral(area)};
  if (stride >= 2) {
    const MeshLayout& kept = layouts.emplace_back(MeshLayout::every(stride, record));
    layouts.push_back(MeshLayout::equilateral(kept.spacing_x * kept.spacing_z));
  }
  const std::vector<MeshErrors> found = measure(layouts);
  report.twin = found[0];
  report.regular_rms = found[1].rms;
  if (stride >= 2) report.decimated = {stride, found[2], found[3].rms};
  if (std::min(iso_rms, report.twin.rms) <= rounding_of(archive.metadata())) return;
  SpacingSearch search(iso_rms);
  search.add(1.0, report.twin.rms);
  while (!search.found()) {
    const std::optional<double> ratio = search.next();
    if (!ratio) return;
    const double rms = measure_squares(spacing * *ratio, false).rms;
    if (!(rms > 0.0)) return;
    search.add(*ratio, rms);
  }
  report.equal = measure_squares(spacing * *search.found(), true);
}

}  // namespace

LatticeReport compare_lattices(const ArchiveReader& archive, HeightSource& source, double iso_rms, const Job& job) {
  LatticeReport report;
  Arena(job).execute([&] { compare(archive, source, iso_rms, report, job); });
  return report;
}

}  // namespace isohf
