#include "isohf/convert/stages/code_source.h"

#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace isohf {
namespace {

/// Where elevations are moved into a range, those beyond the source's edge are, too, and counted.
ElevationRange limits_of(const Conversion& conversion) {
  if (conversion.options.clamp_range) return {-HUGE_VAL, HUGE_VAL};
  return {conversion.limits.lowest - conversion.datum, conversion.limits.highest - conversion.datum};
}

}  // namespace

/// Each thread's window of the source.
struct CodeSource::Buffers {
  oneapi::tbb::enumerable_thread_specific<Band> of_thread;
};

CodeSource::CodeSource(const Conversion& conversion, const ElevationRange& held_within)
    : conversion_(conversion),
      cutter_(conversion.cutter(held_within)),
      rows_(conversion.source, conversion.datum, conversion.geometry().wraps_x, conversion.memory.rows),
      buffers_(std::make_unique<Buffers>()) {}

CodeSource::CodeSource(const Conversion& conversion) : CodeSource(conversion, limits_of(conversion)) {
  if (conversion.most_off() > 0.0) smoothing_ = Prefilter::smoothing();
}

CodeSource::~CodeSource() = default;

CodeSource::Part CodeSource::read(TileIndex tile) {
  Part part;
  const Prefilter& exact = conversion_.prefilter;
  const Prefilter& widest = smoothing_ && smoothing_->halo() > exact.halo() ? *smoothing_ : exact;
  if (tile.row != tile_row_) {
    const RowRange rows = cutter_->rows_needed(tile.row);
    rows_.drop_before(rows_.with_halo({0, rows.first, 1, 1}, widest).row);
    tile_row_ = tile.row;
  }
  const std::optional<Window> about = cutter_->window_about(tile);
  if (!about) return part;
  const Window wide = rows_.with_halo(*about, widest);
  part.is_void = wide.columns == 0 || conversion_.source.is_gap(wide);
  if (!part.is_void) part.samples = rows_.hold(wide);
  return part;
}

bool CodeSource::cut(TileIndex tile, const Part& part, const Prefilter& prefilter, std::span<float> heights) {
  if (part.is_void) return false;
  Band& band = buffers_->of_thread.local();
  const auto read = [&](const Window& window) -> std::optional<SourceBand> {
    if (!rows_.read(window, prefilter, band, &part.samples)) return std::nullopt;
    return band.view();
  };
  return cutter_->cut(tile, read, heights);
}

bool CodeSource::heights(TileIndex tile, const Part& part, std::span<float> heights) {
  return cut(tile, part, conversion_.prefilter, heights);
}

std::optional<QuantiserCounts> CodeSource::cut(TileIndex tile, const Part& part, std::vector<float>& heights,
                                               TileCodes& codes) {
  heights.resize(static_cast<std::size_t>(conversion_.plan.grid.shape().stored_vertex_count()));
  if (!this->heights(tile, part, heights)) return std::nullopt;
  if (!smoothing_) return quantise(conversion_.quantisation, conversion_.limits, conversion_.datum, heights, codes);
  std::vector<float> smooth(heights.size());
  (void)cut(tile, part, *smoothing_, smooth);
  return quantise_within(conversion_.quantisation, conversion_.limits, conversion_.datum, conversion_.most_off(),
                         heights, smooth, codes);
}

void CodeSource::for_each(std::int64_t first, std::int64_t end,
                          const std::function<void(std::int64_t, const Part&)>& make) {
  const TileGrid& grid = conversion_.plan.grid;
  std::vector<Part> parts;
  for (std::int64_t from = first; from < end; from += static_cast<std::int64_t>(parts.size())) {
    conversion_.job.throw_if_cancelled();
    parts.clear();
    const std::int64_t to = std::min(end, from + static_cast<std::int64_t>(conversion_.memory.tiles_in_flight));
    for (std::int64_t flat = from; flat < to; ++flat) parts.push_back(read(grid.tile_at(flat)));
    oneapi::tbb::parallel_for(from, to,
                              [&](std::int64_t flat) { make(flat, parts[static_cast<std::size_t>(flat - from)]); });
  }
}

}  // namespace isohf
