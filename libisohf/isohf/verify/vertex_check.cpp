#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "isohf/archive/codec/quantise.h"
#include "isohf/base/arena.h"
#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/surface/resample/height_error.h"
#include "isohf/surface/source/band_reader.h"
#include "isohf/surface/source/source_statistics.h"
#include "isohf/verify.h"

namespace isohf {
namespace {

class VertexCheck {
 public:
  VertexCheck(const ArchiveReader& archive, HeightSource& source)
      : archive_(archive),
        metadata_(archive.metadata()),
        grid_(archive.grid()),
        source_(source),
        kernel_(Kernel::make(known(metadata_.filter, "filter"), known(metadata_.edges, "edges"))),
        prefilter_(Prefilter::make(kernel_.filter(), known(metadata_.acquisition, "acquisition"), kernel_.edges())),
        limits_(code_limits(metadata_)) {
    const SourceInfo& info = source.info();
    if (info.width != metadata_.source.width || info.height != metadata_.source.height) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("{}: {}x{} samples, {} was made from {}x{}", info.path, info.width, info.height,
                              archive.path(), metadata_.source.width, metadata_.source.height));
    }
    const Quantisation& q = metadata_.quantisation;
    const Statistics& statistics = metadata_.statistics;
    const ElevationRange range{statistics.min.value_or(0.0), statistics.max.value_or(0.0)};
    // Whatever the archive was made with; floats are rounded once more.
    datum_ = choose_datum(range);
    const double largest = std::max(std::abs(range.min), std::abs(range.max));
    const double stored = q.type == CodeType::kF32 ? 0x1p-24 * largest : 0.5 * q.scale;
    report_.bound = stored + height_error(kernel_, prefilter_, range, datum_);
    can_clamp_ = metadata_.z_range || statistics.clamped > 0;
  }

  VertexReport run(const Job& job) {
    const auto cutter = make_tile_resampler(grid_, archive_geometry(metadata_), kernel_,
                                            {limits_.lowest - datum_, limits_.highest - datum_});
    BandReader reader(source_, datum_, prefilter_, archive_geometry(metadata_).wraps_x);
    std::vector<VertexReport> tiles(static_cast<std::size_t>(grid_.tile_columns()));
    for (std::int64_t row = 0; row < grid_.tile_rows(); ++row) {
      job.throw_if_cancelled();
      const auto band = reader.read(cutter->rows_needed(row));
      oneapi::tbb::parallel_for(std::int64_t{0}, grid_.tile_columns(), [&](std::int64_t column) {
        tiles[static_cast<std::size_t>(column)] = check_tile(*cutter, *band, {column, row});
      });
      for (const VertexReport& tile : tiles) add(tile);
      job.report({"resample", "rows", row + 1, grid_.tile_rows()});
    }
    return report_;
  }

 private:
  [[nodiscard]] VertexReport check_tile(const TileResampler& cutter, const Band& band, TileIndex tile) const {
    std::vector<float> heights(static_cast<std::size_t>(grid_.shape().stored_vertex_count()));
    cutter.cut(tile, band.view(), heights);
    const std::vector<double> stored = archive_.read_elevations(tile);
    VertexReport found;
    for (std::size_t i = 0; i < heights.size(); ++i) {
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
    found.vertices = static_cast<std::int64_t>(heights.size());
    if (found.wrong > 0) found.first_wrong = tile;
    return found;
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
