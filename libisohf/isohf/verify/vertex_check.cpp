#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "isohf/archive/metadata/cut_record.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/base/arena.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/sampling/resample/height_error.h"
#include "isohf/sampling/source/band_reader.h"
#include "isohf/sampling/source/source_statistics.h"
#include "isohf/surface.h"
#include "isohf/verify.h"
#include "isohf/verify/accuracy/same_source.h"

namespace isohf {
namespace {

/// False of what was cut or joined.
bool states_job(const Metadata& metadata) {
  return std::ranges::any_of(metadata.extensions, [](const auto& extension) { return extension.first == kJobName; });
}

class VertexCheck {
 public:
  VertexCheck(const ArchiveReader& archive, HeightSource& source)
      : archive_(archive),
        metadata_(archive.metadata()),
        grid_(archive.grid()),
        source_(source),
        kernel_(Kernel::make(known(metadata_.filter, "filter"), known(metadata_.edges, "edges"))),
        prefilter_(Prefilter::make(kernel_.filter(), known(metadata_.acquisition, "acquisition"))),
        limits_(code_limits(metadata_)),
        only_on_ground_(!states_job(metadata_)) {
    (void)check_same_source(archive, source.info());
    const Quantisation& q = metadata_.quantisation;
    const Statistics& statistics = metadata_.statistics;
    // Heights were summed above the middle of the range that was asked for, or of what there is; floats are rounded once more.
    const ElevationRange range = metadata_.z_range
                                     ? ElevationRange{metadata_.z_range->first, metadata_.z_range->second}
                                     : ElevationRange{statistics.min.value_or(0.0), statistics.max.value_or(0.0)};
    datum_ = choose_datum(range);
    const double largest = std::max(std::abs(range.min), std::abs(range.max));
    const double stored = q.type == CodeType::kF32 ? 0x1p-24 * largest : metadata_.rounding.value_or(0.5 * q.scale);
    report_.bound = stored + height_error(kernel_, prefilter_, range, datum_);
    // A cut of a projected archive has its own approximation of the map, to a fraction of a sample.
    constexpr double kPlaceError = 0x1p-11;
    if (is_cut(metadata_) && is_warped(metadata_)) report_.bound += kPlaceError * (range.max - range.min);
    can_clamp_ = metadata_.z_range || statistics.clamped > 0;
  }

  VertexReport run(const Job& job) {
    const auto cutter = make_tile_resampler(grid_, archive_geometry(metadata_), kernel_,
                                            {limits_.lowest - datum_, limits_.highest - datum_});
    const Ways ways = choose_ways(*cutter, job);
    SourceRows rows = ways.kept_rows > 0 ? SourceRows(source_, ways.step, job.scratch_folder, ways.kept_rows)
                                         : SourceRows(source_, ways.step);
    BandReader reader(rows, datum_, prefilter_, archive_geometry(metadata_).wraps_x);
    std::vector<VertexReport> tiles(static_cast<std::size_t>(grid_.tile_columns()));
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      for (std::int64_t first = 0; first < grid_.tile_columns(); first += ways.tile_columns) {
        job.throw_if_cancelled();
        const std::int64_t end = std::min(first + ways.tile_columns, grid_.tile_columns());
        const auto band = reader.read(cutter->rows_needed(row), columns_of(*cutter, first, end));
        oneapi::tbb::parallel_for(first, end, [&](std::int64_t column) {
          tiles[static_cast<std::size_t>(column)] = check_tile(*cutter, *band, {column, row});
        });
      }
      for (const VertexReport& tile : tiles) add(tile);
      job.report({"resample", "rows", row + 1, grid_.tile_rows()});
    }
    return report_;
  }

 private:
  /// How the source is read: with a file for its rows where these are too many for memory, a few columns at a time.
  struct Ways {
    ReadStep step;
    std::int64_t kept_rows = 0;
    std::int64_t tile_columns;
  };

  /// The source's columns under some columns of tiles.
  [[nodiscard]] RowRange columns_of(const TileResampler& cutter, std::int64_t first, std::int64_t end) const {
    if (first == 0 && end == grid_.tile_columns()) return {0, source_.info().width - 1};
    RowRange columns = cutter.columns_needed(first);
    for (std::int64_t column = first + 1; column < end; ++column) {
      const RowRange needed = cutter.columns_needed(column);
      columns = {std::min(columns.first, needed.first), std::max(columns.last, needed.last)};
    }
    return columns;
  }

  /// Throws Error{kOutOfMemory}.
  Ways choose_ways(const TileResampler& cutter, const Job& job) {
    constexpr std::uint64_t kReadBytes = std::uint64_t{8} << 20U;
    constexpr std::uint64_t kLeastReadBytes = std::uint64_t{1} << 20U;
    const SourceInfo& info = source_.info();
    Ways ways{ReadStep::make(info, kReadBytes), 0, grid_.tile_columns()};
    if (job.bound_bytes() == 0) return ways;
    std::int64_t rows = 1;
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      const RowRange needed = cutter.rows_needed(row);
      rows = std::max(rows, needed.last - needed.first + 1);
    }
    rows = std::min(rows + 2 * prefilter_.halo(), info.height);
    const auto vertices = static_cast<double>(grid_.shape().stored_vertex_count());
    const double row_bytes = static_cast<double>(size_bytes(info.sample_type)) * static_cast<double>(info.width);
    const auto bytes = [&](const Ways& way) {
      const RowRange columns = columns_of(cutter, 0, way.tile_columns);
      const double raw = way.kept_rows > 0
                             ? static_cast<double>(way.step.most_bytes(info))
                             : static_cast<double>(std::min(rows + 2 * way.step.rows, info.height)) * row_bytes;
      return reading_bytes(job, vertices) + 24.0 * threads_of(job) * vertices +
             static_cast<double>(source_.buffer_bytes()) + raw +
             static_cast<double>(
                 BandReader::memory_bytes(prefilter_, 2, rows, columns.last - columns.first + 1, info)) +
             static_cast<double>(grid_.tile_columns()) * sizeof(VertexReport);
    };
    const auto limit = static_cast<double>(job.bound_bytes());
    if (bytes(ways) <= limit) return ways;
    ways.step = ReadStep::make(info, kLeastReadBytes);
    ways.kept_rows = SourceRows::kept_rows_for(ways.step, rows);
    const SourceGeometry geometry = archive_geometry(metadata_);
    const bool in_parts = !geometry.wraps_x && !geometry.warp;
    while (in_parts && ways.tile_columns > 1 && bytes(ways) > limit) ways.tile_columns = (ways.tile_columns + 1) / 2;
    require_memory(job, bytes(ways), bytes(ways), "comparing", "");
    return ways;
  }

  [[nodiscard]] VertexReport check_tile(const TileResampler& cutter, const Band& band, TileIndex tile) const {
    std::vector<float> heights(static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
    cutter.cut(tile, band.view(), heights);
    const std::vector<double> stored = archive_.read_elevations(tile);
    VertexReport found;
    for (std::size_t i = 0; i < heights.size(); ++i) {
      if (only_on_ground_ && !is_on_ground(tile, i)) continue;
      ++found.vertices;
      const double resampled = double{heights[i]} + datum_;
      if (std::isnan(resampled) || std::isnan(stored[i])) {
        const bool both = std::isnan(resampled) && std::isnan(stored[i]);
        found.voids += both ? 1 : 0;
        found.wrong += both ? 0 : 1;
        continue;
      }
      const double held = std::clamp(resampled, limits_.lowest, limits_.highest);
      if (can_clamp_ && held != resampled && std::abs(stored[i] - held) <= report_.bound) {
        ++found.clamped;
        continue;
      }
      const double error = std::abs(stored[i] - resampled);
      found.worst = std::max(found.worst, error);
      found.wrong += error > report_.bound ? 1 : 0;
    }
    if (found.wrong > 0) found.first_wrong = tile;
    return found;
  }

  [[nodiscard]] bool is_on_ground(TileIndex tile, std::size_t index) const {
    const auto columns = static_cast<std::size_t>(grid_.shape().columns());
    const GridVertex vertex{static_cast<int>(index % columns), static_cast<int>(index / columns)};
    const ObjectVertex place = object_from_grid(grid_.shape(), vertex);
    const WorldPoint at = grid_.world_from_object(tile, {static_cast<double>(place.x), static_cast<double>(place.z)});
    const WorldBounds& ground = metadata_.valid;
    return at.x >= ground.x0 && at.x <= ground.x1 && at.z >= ground.z0 && at.z <= ground.z1;
  }

  void add(const VertexReport& tile) {
    report_.vertices += tile.vertices;
    report_.voids += tile.voids;
    report_.clamped += tile.clamped;
    report_.wrong += tile.wrong;
    report_.worst = std::max(report_.worst, tile.worst);
    if (!report_.first_wrong) report_.first_wrong = tile.first_wrong;
  }

  const ArchiveReader& archive_;
  const Metadata& metadata_;
  TileGrid grid_;
  HeightSource& source_;
  Kernel kernel_;
  Prefilter prefilter_;
  double datum_ = 0.0;
  const CodeLimits limits_;
  /// What was cut from a coarse plane goes on level where the whole's tiles end, and nothing tells where that is.
  const bool only_on_ground_;
  bool can_clamp_ = false;
  VertexReport report_;
};

}  // namespace

VertexReport check_vertices(const ArchiveReader& archive, HeightSource& source, const Job& job) {
  VertexReport report;
  Arena(job).execute([&] { report = VertexCheck(archive, source).run(job); });
  return report;
}

}  // namespace isohf
