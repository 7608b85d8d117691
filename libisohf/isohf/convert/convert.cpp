#include "isohf/convert.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>

#include "isohf/archive/tile/quantise.h"
#include "isohf/base/arena.h"
#include "isohf/base/sample.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/run_conversion.h"
#include "isohf/convert/stages/choose_quantisation.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/sampling/resample/height_error.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {
namespace {

constexpr std::int64_t kSide = 64;  ///< of a window, in samples
constexpr std::int64_t kMostWindows = 64;
/// Of a source's samples that windows hold, to choose a density and to estimate an error.
constexpr double kShare = 0.03;
constexpr double kShareOfEstimate = 0.1;
/// A source of up to that many samples is estimated by all of them.
constexpr std::int64_t kSmall = std::int64_t{1} << 20U;
/// A source that is unpacked from its first sample on, or filled, is not estimated beyond that many.
constexpr std::int64_t kMostUnpacked = std::int64_t{1} << 25U;

/// Densities that are tried: each more than the one before by this.
constexpr double kLeastDensity = 1.0 / 64.0;
constexpr double kMostDensity = 4.0;
constexpr double kDensityStep = 1.05;
constexpr int kAttempts = 8;
constexpr std::size_t kMostAdded = 32;  ///< windows, in each
/// Another filter than the one that is usual must save so much.
constexpr double kWorthAnotherFilter = 0.95;

struct Sums {
  std::int64_t count = 0;
  double squares = 0.0;
  double largest = 0.0;
  std::int64_t lost = 0;  ///< elevations without a surface

  [[nodiscard]] Sums operator+(const Sums& other) const {
    return {count + other.count, squares + other.squares, std::max(largest, other.largest), lost + other.lost};
  }
};

/// A part of the source as heights, and those of its samples that a surface is compared with.
struct HeldWindow {
  Window compared;
  Window held;
  std::vector<float> heights;
  std::vector<char> voids;  ///< empty where there are none
  std::optional<Filter> filter;
  std::vector<float> coefficients;  ///< of `filter`
};

/// A kernel with its prefilter.
struct Reconstruction {
  Kernel kernel;
  Prefilter prefilter;

  static Reconstruction make(Filter filter, const Acquisition& acquisition) {
    return {Kernel::make(filter), Prefilter::make(filter, acquisition)};
  }
};

/// How vertices are stored: to a step from 0 while the codes are not known, or by these.
struct Storing {
  double step = 0.0;  ///< 0: as they are
  std::optional<Quantisation> codes;
  double most_off = 0.0;  ///< as Conversion has it
};

class Windows {
 public:
  /// margin  samples around what a plan's triangles need
  Windows(HeightSource& source, const ConvertOptions& options, std::int64_t margin = 48)
      : source_(source), info_(source.info()), z_range_(options.z_range), margin_(margin) {}

  /// Reads samples with what a surface by this plan, or a denser one, needs around them.
  void add(const Window& compared, const Plan& plan) {
    const auto margin = [&](double steps) { return static_cast<std::int64_t>(std::ceil(steps)) + margin_; };
    const std::int64_t margin_x = margin(8.0 * plan.grid.sigma_x() / plan.frame.spacing_x);
    const std::int64_t margin_z = margin(4.0 * plan.grid.sigma_z() / plan.frame.spacing_z);
    HeldWindow window;
    window.compared = compared;
    Window& held = window.held;
    held.column = std::max<std::int64_t>(compared.column - margin_x, 0);
    held.row = std::max<std::int64_t>(compared.row - margin_z, 0);
    held.columns = std::min(compared.column + compared.columns + margin_x, info_.width) - held.column;
    held.rows = std::min(compared.row + compared.rows + margin_z, info_.height) - held.row;
    const auto count = static_cast<std::size_t>(held.columns * held.rows);
    std::vector<std::byte> raw(count * size_bytes(info_.sample_type));
    source_.read_window(held, raw);
    window.heights.resize(count);
    if (!datum_) {
      heights_from_samples(info_, 0.0, raw, window.heights);
      const auto valid = std::find_if(window.heights.begin(), window.heights.end(), [](float h) { return h == h; });
      if (valid != window.heights.end()) datum_ = choose_datum({double{*valid}, double{*valid}});
    }
    heights_from_samples(info_, datum_.value_or(0.0), raw, window.heights);
    if (std::any_of(window.heights.begin(), window.heights.end(), [](float h) { return h != h; })) {
      window.voids.resize(count);
      std::transform(window.heights.begin(), window.heights.end(), window.voids.begin(),
                     [](float h) { return static_cast<char>(h != h ? 1 : 0); });
    }
    windows_.push_back(std::move(window));
  }

  [[nodiscard]] bool holds(const Window& sample) const {
    return std::any_of(windows_.begin(), windows_.end(), [&](const HeldWindow& window) {
      const Window& compared = window.compared;
      return sample.column >= compared.column && sample.column < compared.column + compared.columns &&
             sample.row >= compared.row && sample.row < compared.row + compared.rows;
    });
  }

  /// The errors at all samples compared, on all threads; no window is left.
  [[nodiscard]] Sums take_errors(const Plan& plan, const Reconstruction& by, const Storing& storing) {
    std::vector<Sums> parts(windows_.size());
    oneapi::tbb::parallel_for(std::size_t{0}, parts.size(),
                              [&](std::size_t i) { parts[i] = errors_in(windows_[i], plan, by, storing); });
    windows_.clear();
    return std::accumulate(parts.begin(), parts.end(), Sums{});
  }

  /// The elevations of all windows, none of which is left; nullopt where all are void.
  [[nodiscard]] std::optional<ElevationRange> take_range() {
    ElevationRange range{HUGE_VAL, -HUGE_VAL};
    for (const HeldWindow& window : windows_) {
      for (const float height : window.heights) {
        const double elevation = double{height} + datum_.value_or(0.0);  // NaN compares false
        range.min = elevation < range.min ? elevation : range.min;
        range.max = elevation > range.max ? elevation : range.max;
      }
    }
    windows_.clear();
    return range.min <= range.max ? std::optional(range) : std::nullopt;
  }

  /// Whether all are within `most`. What failed last is asked first.
  [[nodiscard]] bool are_within(double most, const Plan& plan, const Reconstruction& by, double step) {
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      if (errors_in(windows_[i], plan, by, {step, {}}).largest <= most) continue;
      std::rotate(windows_.begin(), windows_.begin() + static_cast<std::ptrdiff_t>(i),
                  windows_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      return false;
    }
    return true;
  }

 private:
  [[nodiscard]] Sums errors_in(HeldWindow& window, const Plan& plan, const Reconstruction& by,
                               const Storing& storing) const;
  void store(const Storing& storing, std::span<const float> smooth, std::span<float> heights) const;

  HeightSource& source_;
  const SourceInfo& info_;
  std::optional<std::pair<double, double>> z_range_;
  std::int64_t margin_;
  std::optional<double> datum_;
  std::vector<HeldWindow> windows_;
};

SourceBand band_of(HeldWindow& window, const Reconstruction& by) {
  const Window& held = window.held;
  if (window.filter != by.kernel.filter()) {
    window.filter = by.kernel.filter();
    window.coefficients = window.heights;
    by.prefilter.filter({window.coefficients.data(), held.columns, held.rows});
  }
  return {{window.coefficients.data(), held.columns, held.rows},
          held.row,
          {window.voids.empty() || by.prefilter.is_identity() ? nullptr : window.voids.data(), held.columns, held.rows},
          held.column};
}

/// Leaves what is read of the heights once they are stored.
void Windows::store(const Storing& storing, std::span<const float> smooth, std::span<float> heights) const {
  const double datum = datum_.value_or(0.0);
  if (storing.codes) {
    const CodeLimits limits = z_range_ ? CodeLimits{z_range_->first, z_range_->second} : code_limits(*storing.codes);
    TileCodes tile;
    if (smooth.empty()) {
      (void)quantise(*storing.codes, limits, datum, heights, tile);
    } else {
      (void)quantise_within(*storing.codes, limits, datum, storing.most_off, heights, smooth, tile);
    }
    for (std::size_t i = 0; i < heights.size(); ++i) {
      heights[i] = static_cast<float>(elevation_of_vertex(tile, *storing.codes, i) - datum);
    }
    return;
  }
  for (float& height : heights) {
    if (std::isnan(height)) continue;
    double elevation = double{height} + datum;
    if (z_range_) elevation = std::clamp(elevation, z_range_->first, z_range_->second);
    height = static_cast<float>((storing.step > 0.0 ? std::round(elevation / storing.step) * storing.step : elevation) -
                                datum);
  }
}

/// Cuts the piece of the plan's lattice that covers the window, as one tile of a size of its own.
Sums Windows::errors_in(HeldWindow& window, const Plan& plan, const Reconstruction& by, const Storing& storing) const {
  const Window& compared = window.compared;
  const TileGrid& grid = plan.grid;
  const SourceFrame& frame = plan.frame;
  const std::optional<ExactWarp> warp = frame.warp ? std::optional<ExactWarp>(*frame.warp) : std::nullopt;
  const auto world = [&](double column, double row) -> WorldPoint {
    if (warp) return warp->world_from_source({column, row});
    return {frame.first_sample_x + column * frame.spacing_x, frame.first_sample_z + row * frame.spacing_z};
  };
  WorldBounds bounds{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const double t : {0.0, 0.5, 1.0}) {
    for (const double s : {0.0, 0.5, 1.0}) {
      const WorldPoint at = world(static_cast<double>(compared.column) + s * static_cast<double>(compared.columns - 1),
                                  static_cast<double>(compared.row) + t * static_cast<double>(compared.rows - 1));
      bounds = {std::min(bounds.x0, at.x), std::min(bounds.z0, at.z), std::max(bounds.x1, at.x),
                std::max(bounds.z1, at.z)};
    }
  }
  const double column_step = 2.0 * grid.sigma_x();
  const double row_pair = 2.0 * grid.sigma_z();
  const double west = std::floor(bounds.x0 / column_step) - 1.0;
  const double north = std::floor(bounds.z0 / row_pair);
  const double cells = std::ceil(bounds.x1 / column_step) + 1.0 - west;
  const double pairs = std::ceil(bounds.z1 / row_pair) - north;
  // Next to a pole they are too many; fewer than one where the map does not show the window.
  if (!(cells >= 1.0 && cells <= 4096.0 && pairs <= 4096.0)) return {};
  const TileShape shape = TileShape::make(static_cast<int>(cells) + 4, 2 * std::max(static_cast<int>(pairs), 1) + 3, 1);
  const TileGrid tile =
      TileGrid::make(shape, 1, 1, column_step * shape.cell_columns(), grid.sigma_z() * shape.cell_rows());
  SourceGeometry geometry = frame.geometry();
  geometry.first_sample_x -= west * column_step;
  geometry.first_sample_z -= north * row_pair;
  const Window& held = window.held;
  RowRange columns{0, -1};
  if (geometry.warp) {
    geometry.warp->origin.easting += west * column_step;
    geometry.warp->origin.northing -= north * row_pair;
    std::vector<double> u(static_cast<std::size_t>(shape.stored_vertex_count()));
    std::vector<double> v(u.size());
    SourceWarp(tile, *geometry.warp, 0.0).positions({0, 0}, u, v);
    const auto [least, most] = std::minmax_element(u.begin(), u.end());
    constexpr std::int64_t kMargin = 12;  ///< for a kernel's taps, and for the most of its prefilter's
    if (!(*least > -1e9 && *most < 1e9)) return {};
    columns = {static_cast<std::int64_t>(*least) - kMargin, static_cast<std::int64_t>(*most) + kMargin};
    columns = {std::max<std::int64_t>(columns.first, 0), std::min(columns.last, info_.width - 1)};
  }
  const auto cutter = make_tile_resampler(tile, geometry, by.kernel, {-HUGE_VAL, HUGE_VAL});
  if (!geometry.warp) {
    const Window about = *cutter->window_about({0, 0});
    columns = {about.column, about.column + about.columns - 1};
  }
  const RowRange rows = cutter->rows_needed(0);
  const bool is_held = columns.first >= held.column && columns.last < held.column + held.columns &&
                       rows.first >= held.row && rows.last < held.row + held.rows;
  if (!is_held) return {};  // across the seam of a joined source, or where the map is too far from square
  std::vector<float> heights(static_cast<std::size_t>(shape.stored_vertex_count()));
  cutter->cut_from(band_of(window, by), {0, 0}, heights);
  std::vector<float> smooth;
  if (storing.most_off > 0.0) {
    smooth.resize(heights.size());
    window.filter.reset();  // the coefficients are others'
    cutter->cut_from(band_of(window, {by.kernel, Prefilter::smoothing()}), {0, 0}, smooth);
    window.filter.reset();
  }
  store(storing, smooth, heights);
  const View2D<const float> view(heights.data(), shape.columns(), shape.rows());
  Sums sums;
  for (std::int64_t r = compared.row; r < compared.row + compared.rows; ++r) {
    for (std::int64_t c = compared.column; c < compared.column + compared.columns; ++c) {
      const auto at = static_cast<std::size_t>((r - held.row) * held.columns + c - held.column);
      const WorldPoint place = world(static_cast<double>(c), static_cast<double>(r));
      if (!std::isfinite(place.x) || !std::isfinite(place.z)) continue;  // not on the map
      const ObjectPoint object{(place.x - west * column_step) / grid.sigma_x(),
                               (place.z - north * row_pair) / grid.sigma_z()};
      const double error =
          std::abs(interpolate(snapped(barycentric(shape, object)), view) - double{window.heights[at]});
      if (!(error >= 0.0)) {  // void
        sums.lost += std::isnan(window.heights[at]) ? 0 : 1;
        continue;
      }
      ++sums.count;
      sums.squares += error * error;
      sums.largest = std::max(sums.largest, error);
    }
  }
  return sums;
}

/// Windows all over the source, from North to South.
std::vector<Window> spread_windows(const SourceInfo& info, double share = kShare) {
  const double samples = static_cast<double>(info.width) * static_cast<double>(info.height);
  const double wanted =
      std::clamp(share * samples / static_cast<double>(kSide * kSide), 4.0, static_cast<double>(kMostWindows));
  const auto across = static_cast<std::int64_t>(std::sqrt(wanted));
  std::vector<Window> windows;
  for (std::int64_t i = 0; i < across * across; ++i) {
    const auto along = [&](std::int64_t size, std::int64_t cell, double irrational) {
      // Somewhere else in each cell, so that no regular pattern of the land is met again and again.
      const std::int64_t first = size * cell / across;
      const std::int64_t length = std::max<std::int64_t>(size * (cell + 1) / across - first, 1);
      const std::int64_t side = std::min(kSide, length);
      const double whole = irrational * static_cast<double>(i);
      return std::pair(
          first + static_cast<std::int64_t>((whole - std::floor(whole)) * static_cast<double>(length - side)), side);
    };
    const auto [column, columns] = along(info.width, i % across, std::numbers::phi);
    const auto [row, rows] = along(info.height, i / across, std::numbers::sqrt2);
    windows.push_back({column, row, columns, rows});
  }
  return windows;
}

/// The step that elevations will have, so far as the samples need not be known for it; else 0.
double expected_step(const SourceInfo& info, const ConvertOptions& options) {
  if (options.code_type == CodeType::kF32) return 0.0;
  if (options.step) return *options.step;
  if (options.max_rounding) return 2.0 * *options.max_rounding;
  if (options.max_error) return *options.max_error / 4.0;
  return is_floating(info.sample_type) || options.code_type != CodeType::kU16 ? 0.0 : std::abs(info.z_scale) / 2.0;
}

/// Whether the density is convert()'s to choose.
bool is_density_free(const PlanRequest& request) {
  return !request.density && !request.spacing;
}

/// Plans in the order of their cost.
std::vector<Plan> plans_for(const SourceInfo& info, const ConvertOptions& options) {
  PlanRequest request = options.plan;
  const Plan first = plan_conversion(info, options);
  if (!is_density_free(request)) return {first};
  std::vector<Plan> plans;
  const bool can_meet_samples = can_go_through_samples(first.frame, request);
  const double most = can_meet_samples ? 2.0 : kMostDensity;
  for (double density = kLeastDensity; density < most; density *= kDensityStep) {
    request.density = density;
    plans.push_back(make_plan(info, request));
  }
  request.density.reset();
  if (can_meet_samples) {
    request.through_samples = true;
  } else {
    request.density = kMostDensity;
  }
  plans.push_back(make_plan(info, request));
  return plans;
}

/// Around a sample where a surface failed.
Window window_around(const ErrorPeak& peak, const SourceInfo& info) {
  constexpr std::int64_t kAround = 16;
  Window window;
  window.column = std::max<std::int64_t>(peak.column - kAround, 0);
  window.row = std::max<std::int64_t>(peak.row - kAround, 0);
  window.columns = std::min(peak.column + kAround, info.width) - window.column;
  window.rows = std::min(peak.row + kAround, info.height) - window.row;
  return window;
}

/// Windows of the source that are held in memory tell the smallest density (and the filter) that holds on them; the
/// archive made with it is measured, and where it fails its worst places become windows, too. So on, up to eight times,
/// to the lattice that runs through all samples, or to density 4 where there is none (projected or joined sources).
/// options.resume continues the first of these conversions only.
ConvertSummary convert_within(HeightSource& source, const std::string& output, const ConvertOptions& options,
                              const Job& job) {
  const SourceInfo& info = source.info();
  const double most = *options.max_error;
  const bool chooses_density = is_density_free(options.plan);
  const std::vector<Plan> plans = plans_for(info, options);
  std::vector<Filter> filters = {options.filter.value_or(kDefaultFilter)};
  if (!options.filter) filters.push_back(Filter::kBspline3);
  const double step = expected_step(info, options);
  Windows windows(source, options);
  Arena threads(job);
  threads.execute([&] {
    for (const Window& window : spread_windows(info)) windows.add(window, plans.front());
  });

  // The first plan, from this one on, that holds on the windows.
  const auto search = [&](std::size_t from, Filter filter) {
    const Reconstruction by = Reconstruction::make(filter, options.acquisition);
    std::size_t at = from;
    threads.execute([&] {
      while (at + 1 < plans.size() && !windows.are_within(most, plans[at], by, step)) {
        job.throw_if_cancelled();
        ++at;
      }
    });
    return at;
  };
  std::size_t next = 0;
  double reached = HUGE_VAL;
  double reached_density = 0.0;
  std::uint64_t reached_bytes = 0;
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::size_t chosen = search(next, filters.front());
    ConvertOptions now = options;
    now.filter = filters.front();
    if (filters.size() > 1) {
      const std::size_t other = search(next, filters.back());
      if (plans[other].density <= kWorthAnotherFilter * plans[chosen].density) {
        chosen = other;
        now.filter = filters.back();
      }
    }
    if (attempt + 1 == kAttempts) chosen = plans.size() - 1;
    now.plan.through_samples =
        chooses_density && chosen + 1 == plans.size() && std::abs(plans[chosen].density - 2.0) < 1e-6;
    now.resume = options.resume && attempt == 0;
    ConversionResult result = run_conversion(source, plans[chosen], output, now, job, attempt > 0);
    if (result.is_finished) return std::move(result.summary);
    if (result.measured->max < reached) {
      reached = result.measured->max;
      reached_density = plans[chosen].density;
      reached_bytes = result.summary.archive_bytes;
    }
    if (chosen + 1 == plans.size()) break;
    // Never the same again, and in larger steps the longer it takes.
    next = std::min(chosen + (std::size_t{1} << static_cast<unsigned>(std::max(attempt - 1, 0))), plans.size() - 1);
    std::size_t added = 0;
    for (const ErrorPeak& peak : result.measured->peaks) {
      if (windows.holds({peak.column, peak.row, 1, 1})) continue;
      if (++added > kMostAdded) break;
      windows.add(window_around(peak, info), plans[next]);
    }
  }
  throw Error(
      ErrorCode::kInvalidArgument,
      fmt::format("{}: the surface cannot be held to `max_error` {}: the smallest error reached is {:.6g}, with "
                  "{:.3g} vertices a sample and {} bytes; allow that much{}",
                  info.path, most, reached, reached_density, reached_bytes,
                  chooses_density
                      ? ", or let every sample be a vertex, with a finer `step` or `code_type` f32, and without "
                        "`fit`, `wrap_x` and projections other than equirectangular"
                      : ", or leave `density` and `spacing` out"));
}

/// Windows by which a source's error is estimated: all of a small one. What is unpacked or filled is so by rows: it is
/// read in whole ones, from North to South, but for sources whose rows are curves of the world.
std::vector<Window> windows_of_estimate(const SourceInfo& info, bool is_slow, bool is_curved) {
  constexpr std::int64_t kColumns = 1024;
  const bool is_small = info.width <= kSmall / info.height;
  if (!is_small && (!is_slow || is_curved)) return spread_windows(info, kShareOfEstimate);
  const std::int64_t columns = is_curved ? kSide : kColumns;
  const std::int64_t rows = is_small ? kSide : kSide / 4;
  const std::int64_t every = is_small ? rows : rows * static_cast<std::int64_t>(1.0 / kShareOfEstimate);
  std::vector<Window> windows;
  for (std::int64_t row = (every - rows) / 2; row < info.height; row += every) {
    for (std::int64_t column = 0; column < info.width; column += columns) {
      windows.push_back({column, row, std::min(columns, info.width - column), std::min(rows, info.height - row)});
    }
  }
  return windows;
}

/// The codes that elevations in this range will have; floats where they would be refused.
Quantisation expected_codes(const SourceInfo& info, const ConvertOptions& options, const Reconstruction& by,
                            const ElevationRange& range) {
  const QuantisationRequest request =
      quantisation_request(info, options, height_error(by.kernel, by.prefilter, range, choose_datum(range)));
  try {
    return options.z_range ? quantisation_of_range(request, range, info) : choose_quantisation(request, range, info);
  } catch (const Error&) {
    return {CodeType::kF32};
  }
}

}  // namespace

ConvertSummary convert(HeightSource& source, const std::string& output, const ConvertOptions& options, const Job& job) {
  if (options.max_error) return convert_within(source, output, options, job);
  return run_conversion(source, plan_conversion(source.info(), options), output, options, job).summary;
}

ErrorEstimate estimate_error(HeightSource& source, const ConvertOptions& options, const Job& job,
                             std::optional<Quantisation> codes) {
  const SourceInfo& info = source.info();
  const Plan plan = plan_conversion(info, options);
  const bool is_unpacked = info.format == "PNG";
  const bool is_slow = info.fill_distance > 0 || is_unpacked;
  ErrorEstimate estimate;
  if (is_slow && info.width > kMostUnpacked / info.height) {
    estimate.why_none = fmt::format("the input would have to be {} once more", is_unpacked ? "unpacked" : "filled");
    return estimate;
  }
  const Reconstruction by = Reconstruction::make(options.filter.value_or(kDefaultFilter), options.acquisition);
  const bool looks_far = !by.prefilter.is_identity() || plan.frame.warp || chooses_codes(options);
  Windows windows(source, options, looks_far ? 48 : 12);
  const std::vector<Window> places = windows_of_estimate(info, is_slow, plan.frame.warp.has_value());
  Sums sums;
  Arena(job).execute([&] {
    const auto in_turn = [&](auto take) {
      const std::size_t at_once = job.memory_bytes != 0 ? 1 : 16;
      for (std::size_t first = 0; first < places.size(); first += at_once) {
        job.throw_if_cancelled();
        for (std::size_t i = first; i < std::min(first + at_once, places.size()); ++i) windows.add(places[i], plan);
        take();
      }
    };
    std::optional<ElevationRange> range;
    if (options.z_range) range = {options.z_range->first, options.z_range->second};
    if (!codes && !range) {
      in_turn([&] {
        const std::optional<ElevationRange> part = windows.take_range();
        if (!range) range = part;
        if (part) range = {std::min(range->min, part->min), std::max(range->max, part->max)};
      });
    }
    if (!codes && range) codes = expected_codes(info, options, by, *range);
    if (!codes) return;  // all is void
    const Storing storing{0.0, codes, chooses_codes(options) ? *options.max_rounding : 0.0};
    in_turn([&] { sums = sums + windows.take_errors(plan, by, storing); });
  });
  if (sums.count == 0) {
    estimate.why_none = "no elevation was found where it was looked for";
    return estimate;
  }
  return {std::sqrt(sums.squares / static_cast<double>(sums.count)), sums.largest, sums.count, sums.lost, {}};
}

}  // namespace isohf
