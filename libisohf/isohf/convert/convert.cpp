#include "isohf/convert.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "isohf/base/arena.h"
#include "isohf/base/sample.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/run_conversion.h"
#include "isohf/error.h"
#include "isohf/lattice/barycentric.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {
namespace {

constexpr std::int64_t kSide = 64;  ///< of a window, in samples
constexpr std::int64_t kMostWindows = 64;
/// Of a source's samples that are looked at; a source of so many is looked at anyhow.
constexpr double kShare = 0.03;
constexpr std::int64_t kSmall = std::int64_t{1} << 20U;

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

class Windows {
 public:
  Windows(HeightSource& source, const ConvertOptions& options)
      : source_(source), info_(source.info()), z_range_(options.z_range) {}

  /// Reads samples with what a surface by this plan, or a denser one, needs around them.
  void add(const Window& compared, const Plan& plan) {
    constexpr std::int64_t kTapsAndHalo = 48;
    const auto margin = [](double steps) { return static_cast<std::int64_t>(std::ceil(steps)) + kTapsAndHalo; };
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

  /// The errors at all samples compared of the window added last, which is let go.
  [[nodiscard]] Sums take_errors(const Plan& plan, const Reconstruction& by, double step) {
    HeldWindow window = std::move(windows_.back());
    windows_.pop_back();
    return errors_in(window, plan, by, step);
  }

  /// Whether all are within `most`. What failed last is asked first.
  [[nodiscard]] bool are_within(double most, const Plan& plan, const Reconstruction& by, double step) {
    for (std::size_t i = 0; i < windows_.size(); ++i) {
      if (errors_in(windows_[i], plan, by, step).largest <= most) continue;
      std::rotate(windows_.begin(), windows_.begin() + static_cast<std::ptrdiff_t>(i),
                  windows_.begin() + static_cast<std::ptrdiff_t>(i) + 1);
      return false;
    }
    return true;
  }

 private:
  [[nodiscard]] Sums errors_in(HeldWindow& window, const Plan& plan, const Reconstruction& by, double step) const;

  HeightSource& source_;
  const SourceInfo& info_;
  std::optional<std::pair<double, double>> z_range_;
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

/// Cuts the piece of the plan's lattice that covers the window, as one tile of a size of its own.
Sums Windows::errors_in(HeldWindow& window, const Plan& plan, const Reconstruction& by, double step) const {
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
  SourceGeometry geometry = frame.geometry(plan.outside);
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
  if (!geometry.warp) columns = cutter->columns_needed(0);
  const RowRange rows = cutter->rows_needed(0);
  const bool is_held = columns.first >= held.column && columns.last < held.column + held.columns &&
                       rows.first >= held.row && rows.last < held.row + held.rows;
  if (!is_held) return {};  // across the seam of a joined source, or where the map is too far from square
  std::vector<float> heights(static_cast<std::size_t>(shape.stored_vertex_count()));
  cutter->cut({0, 0}, band_of(window, by), heights);
  const double datum = datum_.value_or(0.0);
  for (float& height : heights) {
    if (std::isnan(height)) continue;
    double elevation = double{height} + datum;
    if (z_range_) elevation = std::clamp(elevation, z_range_->first, z_range_->second);
    height = static_cast<float>((step > 0.0 ? std::round(elevation / step) * step : elevation) - datum);
  }
  const View2D<const float> view(heights.data(), shape.columns(), shape.rows());
  Sums sums;
  for (std::int64_t r = compared.row; r < compared.row + compared.rows; ++r) {
    for (std::int64_t c = compared.column; c < compared.column + compared.columns; ++c) {
      const auto at = static_cast<std::size_t>((r - held.row) * held.columns + c - held.column);
      const WorldPoint place = world(static_cast<double>(c), static_cast<double>(r));
      if (!std::isfinite(place.x) || !std::isfinite(place.z)) continue;  // not on the map
      const ObjectPoint object{(place.x - west * column_step) / grid.sigma_x(),
                               (place.z - north * row_pair) / grid.sigma_z()};
      const double error = std::abs(interpolate(barycentric(shape, object), view) - double{window.heights[at]});
      if (!(error >= 0.0)) continue;  // void
      ++sums.count;
      sums.squares += error * error;
      sums.largest = std::max(sums.largest, error);
    }
  }
  return sums;
}

/// Windows all over the source, from North to South.
std::vector<Window> spread_windows(const SourceInfo& info) {
  const double samples = static_cast<double>(info.width) * static_cast<double>(info.height);
  const double wanted =
      std::clamp(kShare * samples / static_cast<double>(kSide * kSide), 4.0, static_cast<double>(kMostWindows));
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
  return !request.density && !request.spacing && !request.tiles;
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
                  chooses_density ? ", or let every sample be a vertex: without `fit`, `wrap_x` and projections other "
                                    "than equirectangular, and with a step that is fine enough"
                                  : ", or leave `density`, `spacing` and `tiles` out"));
}

}  // namespace

ConvertSummary convert(HeightSource& source, const std::string& output, const ConvertOptions& options, const Job& job) {
  if (options.max_error) return convert_within(source, output, options, job);
  return run_conversion(source, plan_conversion(source.info(), options), output, options, job).summary;
}

std::optional<ErrorEstimate> estimate_error(HeightSource& source, const ConvertOptions& options, const Job& job) {
  const SourceInfo& info = source.info();
  // These are unpacked from their first sample on, or look far around each window.
  const bool is_slow = info.fill_distance > 0 || info.format == "PNG" || info.path.ends_with(".gz");
  if ((is_slow && info.width * info.height > kSmall) || job.memory_bytes != 0) return std::nullopt;
  const Plan plan = plan_conversion(info, options);
  Sums sums;
  Job alone;
  alone.threads = 1;  // not worth more
  Arena(alone).execute([&] {
    Windows windows(source, options);
    const Reconstruction by = Reconstruction::make(options.filter.value_or(kDefaultFilter), options.acquisition);
    const double step = expected_step(info, options);
    for (const Window& window : spread_windows(info)) {
      windows.add(window, plan);
      const Sums part = windows.take_errors(plan, by, step);
      sums.count += part.count;
      sums.squares += part.squares;
      sums.largest = std::max(sums.largest, part.largest);
    }
  });
  if (sums.count == 0) return std::nullopt;
  return ErrorEstimate{std::sqrt(sums.squares / static_cast<double>(sums.count)), sums.largest, sums.count};
}

}  // namespace isohf
