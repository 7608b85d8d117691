#include "isohf/convert/stages/tile_source.h"
#include "isohf/base/sample.h"

#include <oneapi/tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>

namespace isohf {
namespace {

SourceRows make_rows(const Conversion& conversion) {
  const MemoryPlan& memory = conversion.memory;
  if (memory.scratch_rows == 0) return {conversion.source, memory.read_step};
  return {conversion.source, memory.read_step, conversion.job.scratch_folder, memory.scratch_rows};
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

TileSource::TileSource(const Conversion& conversion, const ElevationRange& limits, const Prefilter& prefilter)
    : conversion_(conversion),
      prefilter_(prefilter),
      cutter_(conversion.cutter(limits)),
      cuts_windows_(prefilter_.is_identity() && !conversion.plan.frame.warp),
      reads_whole_rows_(conversion.plan.frame.warp || conversion.plan.frame.wraps_x),
      rows_(make_rows(conversion)),
      bands_(rows_, conversion.datum, prefilter_, conversion.geometry().wraps_x),
      windows_(std::make_unique<Windows>()) {
  for (std::int64_t column = 0; column < conversion.plan.grid.tile_columns(); ++column) {
    columns_needed_.push_back(cutter_->columns_needed(column));
  }
}

TileSource::~TileSource() = default;

std::shared_ptr<const TileSource::Part> TileSource::read(TileIndex tile) {
  const auto part = std::make_shared<Part>();
  part->tile_row = tile.row;
  part->rows = cutter_->rows_needed(tile.row);
  const std::int64_t at_once = conversion_.memory.tile_columns_at_once;
  part->first_column = tile.column / at_once * at_once;
  part->end_column = std::min(part->first_column + at_once, conversion_.plan.grid.tile_columns());
  if (cuts_windows_) {
    part->raw = rows_.rows(part->rows);
    return part;
  }
  RowRange columns = RowRange::none();
  for (std::int64_t column = part->first_column; column < part->end_column; ++column) {
    const RowRange& needed = columns_needed_[static_cast<std::size_t>(column)];
    columns = {std::min(columns.first, needed.first), std::max(columns.last, needed.last)};
  }
  if (reads_whole_rows_ || at_once >= conversion_.plan.grid.tile_columns())
    columns = {0, conversion_.source.info().width - 1};
  part->band = bands_.read(part->rows, columns);
  return part;
}

bool TileSource::cut(TileIndex tile, const Part& part, std::span<float> heights) const {
  if (part.band) {
    cutter_->cut(tile, part.band->view(), heights);
    return true;
  }
  const SourceInfo& info = conversion_.source.info();
  const RowRange& columns = columns_needed_[static_cast<std::size_t>(tile.column)];
  const std::int64_t width = columns.last - columns.first + 1;
  const std::int64_t rows = part.rows.last - part.rows.first + 1;
  Windows::Window& window = windows_->of_thread.local();
  window.heights.resize(static_cast<std::size_t>(width * rows));
  for (std::int64_t r = 0; r < rows; ++r) {
    heights_from_samples(info, conversion_.datum, part.raw->part(part.rows.first + r, columns.first, width, window.raw),
                         {window.heights.data() + r * width, static_cast<std::size_t>(width)});
  }
  const auto is_void = [](float height) { return std::isnan(height); };
  if (std::all_of(window.heights.begin(), window.heights.end(), is_void)) return false;
  cutter_->cut(tile, {{window.heights.data(), width, rows}, part.rows.first, {}, columns.first}, heights);
  return true;
}

}  // namespace isohf
