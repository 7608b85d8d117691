#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_invoke.h>
#include <oneapi/tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "isohf/base/sample.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/stages/choose_quantisation.h"
#include "isohf/convert/stages/code_source.h"
#include "isohf/error.h"
#include "isohf/sampling/resample/height_error.h"
#include "isohf/sampling/source/edge_range.h"
#include "isohf/sampling/source/source_statistics.h"

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

/// A raw sample without an elevation, of a source that has gaps.
double void_sample(const SourceInfo& info) {
  if (is_floating(info.sample_type)) return std::numeric_limits<double>::quiet_NaN();
  return info.void_values.empty() ? sample_range(info.sample_type).first : info.void_values.front();
}

/// First pass: range and counts of the source. While one window is looked at the next one is read.
SourceSurvey survey_source(const Conversion& conversion, EdgeRange& edge) {
  HeightSource& source = conversion.source;
  const SourceInfo& info = source.info();
  const ReadStep& step = conversion.memory.scan_step;
  SourceSurvey survey(info, false);
  std::vector<std::byte> now;
  std::vector<std::byte> next;
  std::vector<std::byte> nothing;  ///< of the largest gap so far
  std::vector<Window> windows = step.windows(info, 0);
  const std::size_t sample_bytes = size_bytes(info.sample_type);
  const auto bytes_of = [&](const Window& window) {
    return static_cast<std::size_t>(window.columns * window.rows) * sample_bytes;
  };
  const auto read = [&](const Window& window, std::vector<std::byte>& raw) {
    raw.clear();
    if (source.is_gap(window)) return;
    raw.resize(bytes_of(window));
    source.read_window(window, raw);
  };
  const auto pass_over = [&](const Window& window) {
    for (std::size_t at = nothing.size(); at < bytes_of(window); at += sample_bytes) {
      nothing.resize(at + sample_bytes);
      store_sample(info.sample_type)(void_sample(info), nothing.data() + at);
    }
    survey.add_voids(window.columns * window.rows);
    edge.add_window(window, std::span(nothing).first(bytes_of(window)));
  };
  read(windows.front(), now);
  for (std::size_t i = 0; i < windows.size();) {
    conversion.job.throw_if_cancelled();
    const Window window = windows[i++];
    if (i == windows.size() && window.row + window.rows < info.height) {
      windows = step.windows(info, window.row + window.rows);
      i = 0;
    }
    const auto look = [&] {
      if (now.empty()) return pass_over(window);
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
    conversion.job.report({"range", "rows", done, info.height});
  }
  return survey;
}

/// Elevations 0 to 1 in floats are most often a fraction of something, and whole numbers without unit and place that
/// are beyond any ground codes.
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
  CodeSource tiles(conversion, {limits.min - conversion.datum, limits.max - conversion.datum});
  std::vector<ElevationRange> ranges(static_cast<std::size_t>(grid.tile_columns()), {HUGE_VAL, -HUGE_VAL});
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    const std::int64_t first = row * grid.tile_columns();
    tiles.for_each(first, first + grid.tile_columns(), [&](std::int64_t flat, const CodeSource::Part& part) {
      std::vector<float> heights(static_cast<std::size_t>(grid.shape().stored_vertex_count()));
      if (!tiles.heights(grid.tile_at(flat), part, heights)) return;
      ElevationRange& range = ranges[static_cast<std::size_t>(flat - first)];
      for (const float height : heights) {
        const double elevation = double{height} + conversion.datum;  // NaN compares false
        range.min = elevation < range.min ? elevation : range.min;
        range.max = elevation > range.max ? elevation : range.max;
      }
    });
    conversion.job.report({"range", "rows", row + 1, grid.tile_rows()});
  }
  ElevationRange all{HUGE_VAL, -HUGE_VAL};
  for (const ElevationRange& range : ranges) {
    all = {std::min(all.min, range.min), std::max(all.max, range.max)};
  }
  return all.min <= all.max ? all : ElevationRange{};
}

/// Also chooses the datum.
QuantisationRequest request_of(Conversion& conversion, const ElevationRange& range) {
  conversion.datum = choose_datum(range);
  conversion.largest = std::max(std::abs(range.min), std::abs(range.max));
  conversion.height_error = height_error(conversion.kernel, conversion.prefilter, range, conversion.datum);
  return quantisation_request(conversion.source.info(), conversion.options, conversion.height_error);
}

/// Warns of values far from all others, such as undeclared voids, and if they stretch the codes until the others share a
/// few.
void warn_of_outliers(const Conversion& conversion, const SourceSurvey& survey, const QuantisationRequest& request,
                      std::vector<Warning>& warnings) {
  constexpr double kFewCodes = 64.0;
  const SourceInfo& info = conversion.source.info();
  const auto [voids, others] = survey.outliers();
  if (voids.empty()) return;
  std::string consequence;
  if (request.type != CodeType::kF32) {
    const double step = conversion.quantisation.scale;
    const double codes = std::floor((others.max - others.min) / step) + 1.0;
    if (codes < kFewCodes && choose_quantisation(request, others, info).scale < step) {
      consequence = codes < 2.0 ? fmt::format(", which share one code of {:.3g}", step)
                                : fmt::format(", which share {} codes of {:.3g}", codes, step);
    }
  }
  const std::string text = survey.warning(consequence);
  if (!text.empty()) warnings.push_back(loss(info.path + ": " + text));
}

}  // namespace

QuantisationRequest quantisation_request(const SourceInfo& info, const ConvertOptions& options, double height_error) {
  QuantisationRequest request{options.code_type, options.step, options.max_rounding};
  request.height_error = height_error;
  // Of the error that is allowed an eighth is left to the rounding, which then takes few bytes.
  if (options.max_error) request.wish = *options.max_error / 4.0;
  // Samples that are vertices lose nothing by the step that is usual.
  if (options.max_error && options.plan.through_samples && !is_floating(info.sample_type)) {
    request.wish = std::max(*request.wish, std::abs(info.z_scale) / 2.0);
  }
  return request;
}

void choose_codes(Conversion& conversion, ConvertSummary& summary) {
  const SourceInfo& info = conversion.source.info();
  if (conversion.options.z_range) {
    const ElevationRange range{conversion.options.z_range->first, conversion.options.z_range->second};
    conversion.quantisation = quantisation_of_range(request_of(conversion, range), range, info);
    conversion.range = range;
    conversion.limits = {range.min, range.max};
    return;
  }
  const SourceAxes axes = make_axes(conversion.plan.grid, conversion.geometry());
  EdgeRange edge(info, axes.x.continued_samples(), axes.z.continued_samples());
  const SourceSurvey survey = survey_source(conversion, edge);
  SourceScan found = survey.scan();
  if (found.valid > 0) warn_of_unit_range(info, found.range, summary.warnings);
  summary.source_voids = found.voids;
  if (found.valid == 0) {
    throw Error(ErrorCode::kNoElevation,
                fmt::format("{}: all {} samples are void or not finite, there is no elevation to convert", info.path,
                            found.voids));
  }
  const QuantisationRequest request = request_of(conversion, found.range);
  found.range = EdgeRange::widen(found.range, edge.bound());
  conversion.quantisation = choose_quantisation(request, found.range, info);
  warn_of_outliers(conversion, survey, request, summary.warnings);
  conversion.range = found.range;
  const double over = overshoot(conversion.kernel, conversion.prefilter);
  if (over > 0.0 && conversion.options.code_type != CodeType::kF32) {
    // The surface may leave the samples' range. Where the codes reach far enough for the worst case at the same step,
    // nothing needs to be measured; next to voids and on a raster between whose ends little lies there is no such
    // bound.
    const bool is_large =
        std::min(info.width, info.height) > 2 * (conversion.prefilter.halo() + conversion.kernel.taps());
    const bool has_step =
        request.max_rounding || (request.step ? *request.step != 0.0 : !is_floating(info.sample_type));
    const ElevationRange reach = widened(found.range, over);
    const bool reaches_all = found.voids == 0 && is_large && has_step && has_codes_for(conversion.quantisation, reach);
    conversion.range = reaches_all ? reach : measure_surface(conversion, found.range);
    conversion.quantisation = reaches_all
                                  ? choose_quantisation({request.type, conversion.quantisation.scale}, reach, info)
                                  : choose_quantisation(request, conversion.range, info);
  }
  conversion.limits = code_limits(conversion.quantisation);
}

}  // namespace isohf
