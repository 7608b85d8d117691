#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "isohf/archive/metadata/cut_record.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/base/arena.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/sampling/resample/height_error.h"
#include "isohf/sampling/source/height_rows.h"
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
    // Slopes beyond the source are held within the range that was asked for, or, if all elevations were moved into it, not.
    const auto free = metadata_.z_range
                          ? make_tile_resampler(grid_, archive_geometry(metadata_), kernel_, {-HUGE_VAL, HUGE_VAL})
                          : nullptr;
    HeightRows rows(source_, datum_, archive_geometry(metadata_).wraps_x, choose_memory(job));
    std::vector<VertexReport> tiles(static_cast<std::size_t>(grid_.tile_columns()));
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      const RowRange needed = cutter->rows_needed(row);
      rows.drop_before(rows.with_halo({0, needed.first, 1, 1}, prefilter_).row);
      oneapi::tbb::parallel_for(std::int64_t{0}, grid_.tile_columns(), [&](std::int64_t column) {
        job.throw_if_cancelled();
        VertexReport& tile = tiles[static_cast<std::size_t>(column)];
        tile = check_tile(*cutter, rows, {column, row});
        if (tile.wrong > 0 && free) tile = check_tile(*free, rows, {column, row});
      });
      for (const VertexReport& tile : tiles) add(tile);
      job.report({"resample", "rows", row + 1, grid_.tile_rows()});
    }
    return report_;
  }

 private:
  /// Throws Error{kOutOfMemory}.
  CellStore choose_memory(const Job& job) {
    constexpr std::uint64_t kMostBytes = std::uint64_t{256} << 20U;
    constexpr std::uint64_t kLeastBytes = std::uint64_t{8} << 20U;
    const SourceInfo& info = source_.info();
    const auto vertices = static_cast<double>(grid_.shape().stored_vertex_count());
    const double needed = reading_bytes(job, vertices) + 40.0 * threads_of(job) * vertices +
                          static_cast<double>(source_.buffer_bytes()) + 2.0 * kLeastBytes +
                          static_cast<double>(grid_.tile_columns()) * sizeof(VertexReport);
    require_memory(job, needed, needed, "comparing", "");
    const double more = static_cast<double>(job.bound_bytes()) - needed;
    const std::uint64_t most =
        job.bound_bytes() == 0 ? kMostBytes : std::min(kMostBytes, kLeastBytes + static_cast<std::uint64_t>(more));
    return CellStore::of_windows(info, most, job.scratch_folder);
  }

  [[nodiscard]] VertexReport check_tile(const TileResampler& cutter, HeightRows& rows, TileIndex tile) const {
    std::vector<float> heights(static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
    Band band;
    const auto read = [&](const Window& window) -> std::optional<SourceBand> {
      if (!rows.read(window, prefilter_, band)) return std::nullopt;
      return band.view();
    };
    if (!cutter.cut(tile, read, heights)) std::ranges::fill(heights, std::numeric_limits<float>::quiet_NaN());
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
