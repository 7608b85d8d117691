#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "isohf/convert/conversion.h"
#include "isohf/convert/stages/choose_quantisation.h"
#include "isohf/convert/stages/tile_source.h"
#include "isohf/error.h"
#include "isohf/surface/resample/height_error.h"
#include "isohf/surface/source/edge_range.h"
#include "isohf/surface/source/source_statistics.h"

namespace isohf {
namespace {

/// What is in a window, by all threads.
SourceSurvey survey_window(const SourceInfo& info, std::span<const std::byte> raw) {
  constexpr std::size_t kGrain = std::size_t{1} << 18U;
  const std::size_t bytes = size_bytes(info.sample_type);
  return oneapi::tbb::parallel_reduce(
      oneapi::tbb::blocked_range<std::size_t>(0, raw.size() / bytes, kGrain), SourceSurvey(info, false),
      [&](const auto& part, SourceSurvey found) {
        found.add(raw.subspan(part.begin() * bytes, part.size() * bytes));
        return found;
      },
      [](SourceSurvey found, const SourceSurvey& other) {
        found.add(other);
        return found;
      });
}

/// First pass: range and counts of some rows of the source. While one window is looked at the next one is read.
SourceSurvey survey_source(const Conversion& conversion, const RowRange& rows, EdgeRange& edge) {
  HeightSource& source = conversion.source;
  const SourceInfo& info = source.info();
  const ReadStep& step = conversion.memory.scan_step;
  SourceSurvey survey(info, false);
  std::vector<std::byte> now;
  std::vector<std::byte> next;
  const std::int64_t end = rows.last + 1;
  const auto windows_at = [&](std::int64_t row) {
    std::vector<Window> band = step.windows(info, row);
    for (Window& window : band) window.rows = std::min(window.rows, end - window.row);
    return band;
  };
  std::vector<Window> windows = windows_at(rows.first);
  const auto read = [&](const Window& window, std::vector<std::byte>& raw) {
    raw.resize(static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info.sample_type));
    source.read_window(window, raw);
  };
  read(windows.front(), now);
  for (std::size_t i = 0; i < windows.size();) {
    conversion.job.throw_if_cancelled();
    const Window window = windows[i++];
    if (i == windows.size() && window.row + window.rows < end) {
      windows = windows_at(window.row + window.rows);
      i = 0;
    }
    const auto look = [&] {
      survey.add(survey_window(info, now));
      edge.add_window(window, now);
    };
    if (i < windows.size()) {
      oneapi::tbb::parallel_invoke(look, [&] { read(windows[i], next); });
    } else {
      look();
    }
    now.swap(next);
    const std::int64_t done = window.row + (i == 0 || i == windows.size() ? window.rows : 0);
    conversion.job.report({"range", "rows", done - rows.first, end - rows.first});
  }
  return survey;
}

/// Elevations 0 to 1 in floats are most often a fraction of something, and whole numbers without unit and place that are
/// beyond any ground codes.
void warn_of_unit_range(const SourceInfo& info, const ElevationRange& range, std::vector<Warning>& warnings) {
  constexpr double kHighest = 9000.0;  // metres on the Earth
  if (info.sample_type == SampleType::kUint16 && range.max > kHighest && info.vertical_unit.empty() &&
      !info.georeference.has_origin && info.z_scale == 1.0 && info.z_offset == 0.0) {
    warnings.push_back(fmt::format(
        "{}: elevations are the numbers that it holds, {:.6g} to {:.6g}, more than any ground is high; where they "
        "are not metres, give `z_scale` and `z_offset`",
        info.path, range.min, range.max));
  }
  if (!is_floating(info.sample_type) || info.z_scale != 1.0 || info.z_offset != 0.0) return;
  if (info.metres_per_vertical_unit > 1.0) return;  // kilometres
  if (range.min >= -0.1 && range.max <= 1.1 && range.max > range.min) {
    warnings.push_back(
        fmt::format("{}: elevations run from {:.4g} to {:.4g}, which looks like a fraction of a height, not "
                    "metres; give `z_scale` and `z_offset`",
                    info.path, range.min, range.max));
  }
}

/// The range of the surface itself, for kernels that leave the range of their samples: cuts every tile, keeps none.
ElevationRange measure_surface(const Conversion& conversion, const ElevationRange& limits) {
  const TileGrid& grid = conversion.plan.grid;
  TileSource tiles(conversion, {limits.min - conversion.datum, limits.max - conversion.datum}, conversion.prefilter);
  std::vector<ElevationRange> ranges(static_cast<std::size_t>(grid.tile_columns()), {HUGE_VAL, -HUGE_VAL});
  std::int64_t next = 0;
  while (next < grid.tile_count()) {
    conversion.job.throw_if_cancelled();
    const std::int64_t first = next;
    const std::shared_ptr<const TileSource::Part> part = tiles.read(grid.tile_at(first));
    while (next < grid.tile_count() && part->holds(grid.tile_at(next))) ++next;
    oneapi::tbb::parallel_for(first, next, [&](std::int64_t flat) {
      const TileIndex tile = grid.tile_at(flat);
      std::vector<float> heights(static_cast<std::size_t>(grid.shape().stored_vertex_count()));
      if (!tiles.cut(tile, *part, heights)) return;
      ElevationRange& range = ranges[static_cast<std::size_t>(tile.column)];
      for (const float height : heights) {
        const double elevation = double{height} + conversion.datum;  // NaN compares false
        range.min = elevation < range.min ? elevation : range.min;
        range.max = elevation > range.max ? elevation : range.max;
      }
    });
    conversion.job.report({"range", "rows", next / grid.tile_columns(), grid.tile_rows()});
  }
  ElevationRange all{HUGE_VAL, -HUGE_VAL};
  for (const ElevationRange& range : ranges) {
    all = {std::min(all.min, range.min), std::max(all.max, range.max)};
  }
  return all.min <= all.max ? all : ElevationRange{};
}

/// Also chooses the datum.
QuantisationRequest request_of(Conversion& conversion, const ElevationRange& range) {
  const SourceInfo& info = conversion.source.info();
  const ConvertOptions& options = conversion.options;
  QuantisationRequest request{options.code_type, options.step, options.max_rounding};
  conversion.datum = choose_datum(range);
  conversion.largest = std::max(std::abs(range.min), std::abs(range.max));
  conversion.height_error = height_error(conversion.kernel, conversion.prefilter, range, conversion.datum);
  request.height_error = conversion.height_error;
  // Of the error that is allowed an eighth is left to the rounding, which then takes few bytes.
  if (options.max_error) request.wish = *options.max_error / 4.0;
  // Samples that are vertices lose nothing by the step that is usual.
  if (options.max_error && options.plan.through_samples && !is_floating(info.sample_type)) {
    request.wish = std::max(*request.wish, std::abs(info.z_scale) / 2.0);
  }
  return request;
}

}  // namespace

void RangeScan::add(const RangeScan& other) {
  if (samples.valid == 0) samples.range = other.samples.range;
  if (other.samples.valid > 0) {
    samples.range.min = std::min(samples.range.min, other.samples.range.min);
    samples.range.max = std::max(samples.range.max, other.samples.range.max);
  }
  samples.valid += other.samples.valid;
  samples.voids += other.samples.voids;
  edges = {std::min(edges.min, other.edges.min), std::max(edges.max, other.edges.max)};
}

RangeScan scan_range(const Conversion& conversion, const RowRange& rows, std::vector<Warning>& warnings) {
  const SourceInfo& info = conversion.source.info();
  const SourceAxes axes = make_axes(conversion.plan.grid, conversion.geometry());
  const bool is_first = rows.first == 0;
  const bool is_last = rows.last + 1 == info.height;
  EdgeRange edge(info, axes.x.continued_samples(), axes.z.continued_samples(), is_first, is_last);
  // Of the rows beside them edges alone are looked at: what lies between two rows, and all of the North and South edge.
  const auto look_at = [&](std::int64_t first, std::int64_t end) {
    if (first >= end) return;
    std::vector<std::byte> raw(static_cast<std::size_t>((end - first) * info.width) * size_bytes(info.sample_type));
    conversion.source.read_window({0, first, info.width, end - first}, raw);
    edge.add_window({0, first, info.width, end - first}, raw);
  };
  if (is_last && !is_first) look_at(std::min(rows.first, info.height - edge.depth_rows()), rows.first);
  const SourceSurvey survey = survey_source(conversion, rows, edge);
  if (!is_last) {
    look_at(rows.last + 1, std::min(std::max(rows.last + 2, is_first ? edge.depth_rows() : 0), info.height));
  }
  const SourceScan found = survey.scan();
  if (found.valid > 0) warn_of_unit_range(info, found.range, warnings);
  if (const std::string warning = survey.warning(); !warning.empty()) warnings.push_back(info.path + ": " + warning);
  return {found, edge.bound()};
}

bool choose_codes_by(Conversion& conversion, const RangeScan& scan, bool may_cut) {
  const SourceInfo& info = conversion.source.info();
  SourceScan found = scan.samples;
  if (found.valid == 0) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("{}: all {} samples are void or not finite, there is no elevation to convert", info.path,
                            found.voids));
  }
  const QuantisationRequest request = request_of(conversion, found.range);
  if (conversion.plan.outside != Outside::kClamp) found.range = EdgeRange::widen(found.range, scan.edges);
  conversion.quantisation = choose_quantisation(request, found.range, info);
  const double over = overshoot(conversion.kernel, conversion.prefilter);
  if (over == 0.0 || conversion.options.code_type == CodeType::kF32) return true;
  // The surface may leave the samples' range. Where the codes reach far enough for the worst case at the same step,
  // nothing needs to be measured; next to voids and on a raster between whose ends little lies there is no such bound.
  const bool is_large =
      std::min(info.width, info.height) > 2 * (conversion.prefilter.halo() + conversion.kernel.taps());
  const bool has_step = request.max_rounding || (request.step ? *request.step != 0.0 : !is_floating(info.sample_type));
  const ElevationRange reach = widened(found.range, over);
  if (found.voids == 0 && is_large && has_step && has_codes_for(conversion.quantisation, reach)) {
    conversion.quantisation = choose_quantisation({request.type, conversion.quantisation.scale}, reach, info);
    return true;
  }
  if (!may_cut) return false;
  conversion.quantisation = choose_quantisation(request, measure_surface(conversion, found.range), info);
  return true;
}

void choose_codes(Conversion& conversion, ConvertSummary& summary) {
  if (conversion.options.z_range) {
    const ElevationRange range{conversion.options.z_range->first, conversion.options.z_range->second};
    conversion.quantisation = quantisation_of_range(request_of(conversion, range), range, conversion.source.info());
    conversion.limits = {range.min, range.max};
    return;
  }
  const RangeScan scan = scan_range(conversion, {0, conversion.source.info().height - 1}, summary.warnings);
  summary.source_voids = scan.samples.voids;
  (void)choose_codes_by(conversion, scan, true);
  conversion.limits = code_limits(conversion.quantisation);
}

}  // namespace isohf
