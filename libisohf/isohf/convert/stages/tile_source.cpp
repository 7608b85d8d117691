#include "isohf/convert/stages/tile_source.h"
#include "isohf/base/sample.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>

namespace isohf {
namespace {

SourceRows make_rows(const Conversion& job) {
  const MemoryPlan& memory = job.memory;
  if (memory.scratch_rows == 0) return {job.source, memory.read_step};
  return {job.source, memory.read_step, job.options.scratch_folder, memory.scratch_rows};
}

}  // namespace

/// Each thread's piece of the source as heights.
struct TileSource::Windows {
  struct Window {
    std::vector<float> heights;
    std::vector<std::byte> raw;
  };
  oneapi::tbb::enumerable_thread_specific<Window> of_thread;
};

TileSource::TileSource(const Conversion& job, const ElevationRange& limits)
    : job_(job),
      cutter_(job.cutter(limits)),
      cuts_windows_(job.prefilter.is_identity() && !job.plan.frame.warp),
      reads_whole_rows_(job.plan.frame.warp || job.plan.frame.wraps_x),
      rows_(make_rows(job)),
      bands_(rows_, job.datum, job.prefilter, job.geometry().wraps_x),
      windows_(std::make_unique<Windows>()) {
  for (std::int64_t column = 0; column < job.plan.grid.tile_columns(); ++column) {
    columns_needed_.push_back(cutter_->columns_needed(column));
  }
}

TileSource::~TileSource() = default;

std::shared_ptr<const TileSource::Part> TileSource::read(TileIndex tile) {
  const auto part = std::make_shared<Part>();
  part->tile_row = tile.row;
  part->rows = cutter_->rows_needed(tile.row);
  const std::int64_t at_once = job_.memory.tile_columns_at_once;
  part->first_column = tile.column / at_once * at_once;
  part->end_column = std::min(part->first_column + at_once, job_.plan.grid.tile_columns());
  if (cuts_windows_) {
    part->raw = rows_.rows(part->rows);
    return part;
  }
  RowRange columns = RowSampler::no_rows();
  for (std::int64_t column = part->first_column; column < part->end_column; ++column) {
    const RowRange& needed = columns_needed_[static_cast<std::size_t>(column)];
    columns = {std::min(columns.first, needed.first), std::max(columns.last, needed.last)};
  }
  if (reads_whole_rows_ || at_once >= job_.plan.grid.tile_columns()) columns = {0, job_.source.info().width - 1};
  part->band = bands_.read(part->rows, columns);
  return part;
}

void TileSource::cut(TileIndex tile, const Part& part, std::span<float> heights) const {
  if (part.band) return cutter_->cut(tile, part.band->view(), heights);
  const SourceInfo& info = job_.source.info();
  const RowRange& columns = columns_needed_[static_cast<std::size_t>(tile.column)];
  const std::int64_t width = columns.last - columns.first + 1;
  const std::int64_t rows = part.rows.last - part.rows.first + 1;
  Windows::Window& window = windows_->of_thread.local();
  window.heights.resize(static_cast<std::size_t>(width * rows));
  for (std::int64_t r = 0; r < rows; ++r) {
    heights_from_samples(info, job_.datum, part.raw->part(part.rows.first + r, columns.first, width, window.raw),
                         {window.heights.data() + r * width, static_cast<std::size_t>(width)});
  }
  cutter_->cut(tile, {{window.heights.data(), width, rows}, part.rows.first, {}, columns.first}, heights);
}

}  // namespace isohf
