#include "isohf/surface.h"

#include <fmt/format.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "isohf/archive/planes/archive_planes.h"
#include "isohf/base/arena.h"
#include "isohf/base/assert.h"
#include "isohf/base/handed_in.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/error.h"
#include "isohf/restore/archive_geometry.h"
#include "isohf/restore/grid_sampler.h"
#include "isohf/restore/point_sampler.h"
#include "isohf/restore/point_shadow.h"
#include "isohf/restore/sample_grids.h"

namespace isohf {
namespace {

/// Samples that are handed over at once, about.
constexpr std::int64_t kSamplesAtOnce = std::int64_t{1} << 20U;
/// Rows that are, at most, where what they are made of is read from a file for each of them.
constexpr std::int64_t kRowsOfScratch = 16;
/// Of a sample: its elevation, and what whoever takes it makes of that.
constexpr double kSampleBytes = 20.0;
/// What a Surface keeps of decoded tiles.
constexpr std::uint64_t kDefaultMemory = std::uint64_t{256} << 20U;
/// What tiles under a grid that goes by places take, at least.
constexpr std::uint64_t kTileBytes = std::uint64_t{16} << 20U;
/// Samples so many times as far apart as the source's are means.
constexpr double kFarApart = 1.5;
/// Vertices of a coarse plane between two means, at least.
constexpr double kPlaneVertices = 32.0;
/// Places beside each other that are looked at together.
constexpr std::int64_t kRun = 64;
/// How far those may be off that are interpolated between others, lattice steps.
constexpr double kInterpolated = 1e-8;

[[noreturn]] void refuse_place(const char* what) {
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("the archive's source has no position in {}; use world coordinates", what));
}

/// Where a place of a grid that goes by places is.
GeoPoint geo_of(const SampleGrid& grid, const MapPoint& place) {
  return grid.system ? grid.system->map->geo_from_map(place) : GeoPoint{place.easting, place.northing};
}

/// Between the samples of a grid, world units.
struct WorldSpacing {
  double x;
  double z;
};

/// As the middle of the grid has it; NaN where the map has no place there.
WorldSpacing world_spacing(const Metadata& metadata, const SampleGrid& grid) {
  if (!grid.goes_by_places()) return {grid.spacing_x, grid.spacing_z};
  const WorldGeoreference georeference(metadata);
  if (!georeference.has_geo()) refuse_place("degrees");
  const MapPoint middle{grid.first_x + static_cast<double>(grid.width - 1) * grid.spacing_x / 2.0,
                        grid.first_z - static_cast<double>(grid.height - 1) * grid.spacing_z / 2.0};
  const auto world = [&](double columns, double rows) {
    const MapPoint at{middle.easting + columns * grid.spacing_x, middle.northing - rows * grid.spacing_z};
    return georeference.world_from_geo(geo_of(grid, at));
  };
  const auto apart = [](WorldPoint a, WorldPoint b) { return std::hypot(b.x - a.x, b.z - a.z); };
  return {apart(world(-0.5, 0.0), world(0.5, 0.0)), apart(world(0.0, -0.5), world(0.0, 0.5))};
}

/// Whether samples lie so far apart that they are means, either way.
bool are_far_apart(const Metadata& metadata, const SampleGrid& grid) {
  const SourceRecord& source = metadata.source;
  WorldSpacing samples{};
  WorldSpacing sources{};
  if (grid.goes_by_places() && is_in_source_system(metadata, grid)) {
    samples = {grid.spacing_x, grid.spacing_z};
    sources = {source.crs_spacing_x, source.crs_spacing_y};
  } else {
    samples = world_spacing(metadata, grid);
    sources = {source.spacing_x, source.spacing_z};
    // Columns and rows that are none of the source's.
    if (is_warped(metadata) || grid.goes_by_places())
      sources.x = sources.z = std::sqrt(source.spacing_x * source.spacing_z);
  }
  constexpr double kLeast = kFarApart * (1.0 - 1e-9);
  return samples.x >= kLeast * sources.x || samples.z >= kLeast * sources.z;
}

/// The coarsest plane that means can be made of; 0 where there is none.
int plane_for(const Metadata& metadata, const SampleGrid& grid) {
  const WorldSpacing spacing = world_spacing(metadata, grid);
  return planes_of(metadata).plane_for_spacing(spacing.x / kPlaneVertices, spacing.z / kPlaneVertices);
}

/// Columns and rows of places in the area of each sample that are no farther apart than the vertices of `tiles`, as the
/// middle of the grid has it; no more than there are vertices.
GridSize parts_of(const Metadata& metadata, const SampleGrid& grid, const TileGrid& tiles) {
  const WorldSpacing spacing = world_spacing(metadata, grid);
  const auto parts = [](double length, double step, double most) {
    const double least = std::min(length, most) / step;  // not a number where the map has no place
    return least > 1.0 ? static_cast<std::int64_t>(std::ceil(least * (1.0 - 1e-9))) : std::int64_t{1};
  };
  return {parts(spacing.x, 2.0 * tiles.sigma_x(), tiles.world_width()),
          parts(spacing.z, tiles.sigma_z(), tiles.world_height())};
}

/// Those places: as many in the area of each sample.
SampleGrid places_of(const SampleGrid& grid, const GridSize& parts) {
  SampleGrid places = grid;
  const auto columns = static_cast<double>(parts.first);
  const auto rows = static_cast<double>(parts.second);
  const double up = grid.spacing_z / 2.0 * (1.0 - 1.0 / rows);
  places.width *= parts.first;
  places.height *= parts.second;
  places.spacing_x /= columns;
  places.spacing_z /= rows;
  places.first_x -= grid.spacing_x / 2.0 * (1.0 - 1.0 / columns);
  places.first_z += grid.goes_by_places() ? up : -up;
  return places;
}

std::string grid_name(const SampleGrid& grid) {
  return fmt::format("a grid of {} x {} samples", grid.width, grid.height);
}

/// Where a projected source ends. Its tiles go on some way beyond it, so that no triangle on its edge is missing.
class SourceOutline {
 public:
  /// nullopt where the source ends with the tiles, or its own map is not understood.
  [[nodiscard]] static std::optional<SourceOutline> of(const Metadata& metadata) {
    const auto& map = metadata.projection;
    const bool is_known = is_warped(metadata) && (metadata.source.crs_unit == "degree" || metadata.source.map) &&
                          (map->spec.kind != ProjectionKind::kSystem || map->spec.map);
    if (!is_known) return std::nullopt;
    return SourceOutline(archive_geometry(metadata));
  }

  /// Makes elevations void whose places lie outside. place_of(i): of the i-th; neighbours lie beside each other.
  template <typename PlaceOf>
  void hold(std::span<double> elevations, const PlaceOf& place_of) const {
    constexpr auto kSome = static_cast<std::size_t>(kRun);
    const std::size_t runs = (elevations.size() + kSome - 1) / kSome;
    oneapi::tbb::parallel_for(std::size_t{0}, runs, [&](std::size_t run) {
      const std::size_t end = std::min((run + 1) * kSome, elevations.size());
      if (is_all_inside(run * kSome, end, place_of)) return;
      for (std::size_t i = run * kSome; i < end; ++i) {
        if (std::isnan(elevations[i]) || inside(warp_.source_from_world(place_of(i))) >= -kRounded) continue;
        elevations[i] = std::numeric_limits<double>::quiet_NaN();
      }
    });
  }

 private:
  static constexpr double kRounded = 0.01;  ///< samples, as georeferences are rounded

  explicit SourceOutline(const SourceGeometry& geometry)
      : warp_(*geometry.warp),
        beyond_(geometry.registration == Registration::kArea ? 0.5 : 0.0),
        width_(geometry.wraps_x ? HUGE_VAL : static_cast<double>(geometry.width) - 1.0),
        height_(static_cast<double>(geometry.height) - 1.0) {}

  /// Between places that lie farther inside than from each other all lies inside.
  template <typename PlaceOf>
  [[nodiscard]] bool is_all_inside(std::size_t first, std::size_t end, const PlaceOf& place_of) const {
    const SourcePosition west = warp_.source_from_world(place_of(first));
    const SourcePosition middle = warp_.source_from_world(place_of((first + end) / 2));
    const SourcePosition east = warp_.source_from_world(place_of(end - 1));
    const auto apart = [](SourcePosition a, SourcePosition b) { return std::abs(a.u - b.u) + std::abs(a.v - b.v); };
    const double far = apart(west, middle) + apart(middle, east);
    return inside(west) > far && inside(middle) > far && inside(east) > far;
  }

  /// Samples from the nearest edge, below 0 outside; NaN where the map shows no ground.
  [[nodiscard]] double inside(SourcePosition at) const {
    const double across = std::isinf(width_) ? HUGE_VAL : std::min(at.u, width_ - at.u);
    return std::min(across, std::min(at.v, height_ - at.v)) + beyond_ + (at.u - at.u);
  }

  ExactWarp warp_;
  double beyond_;  ///< the outermost samples
  double width_;   ///< first to last sample; infinite all the way round
  double height_;
};

void require_as_many(std::size_t samples, std::size_t points) {
  if (samples == points) return;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("there is room for {} samples, must be as many as are asked for, {}", samples, points));
}

}  // namespace

struct Surface::State {
  State(const ArchiveReader& its_archive, const Job& its_job)
      : archive(its_archive),
        job(its_job),
        sampler(archive.grid(), archive.metadata().quantisation, tiles_of(archive),
                job.memory_bytes > 0 ? job.memory_bytes : kDefaultMemory, ground_scale(archive.metadata())),
        georeference(archive.metadata()) {
    if (job.threads != 0) arena.emplace(job);
  }

  template <typename Found>
  void sample(std::span<const WorldPoint> points, std::span<Found> found) {
    job.throw_if_cancelled();
    if (!arena) return sampler.sample(points, found);
    arena->execute([&] { sampler.sample(points, found); });
  }

  const ArchiveReader& archive;
  Job job;
  std::optional<Arena> arena;
  PointSampler sampler;
  WorldGeoreference georeference;
};

Surface::Surface(const ArchiveReader& archive, const Job& job) : state_(std::make_unique<State>(archive, job)) {}

Surface::~Surface() = default;

SurfaceSample Surface::at(WorldPoint point) {
  SurfaceSample sample;
  state_->sample({&point, 1}, std::span(&sample, 1));
  return sample;
}

SurfaceSample Surface::at(GeoPoint point) {
  if (!state_->georeference.has_geo()) refuse_place("degrees");
  return at(state_->georeference.world_from_geo(point));
}

SurfaceSample Surface::at(MapPoint point) {
  if (!state_->georeference.has_source()) refuse_place("coordinates");
  return at(state_->georeference.world_from_source(point));
}

void Surface::sample(std::span<const WorldPoint> points, std::span<SurfaceSample> samples) {
  require_as_many(samples.size(), points.size());
  state_->sample(points, samples);
}

void Surface::sample(std::span<const WorldPoint> points, std::span<double> elevations) {
  require_as_many(elevations.size(), points.size());
  state_->sample(points, elevations);
}

void Surface::sample(std::span<const WorldPoint> points, const Sun& sun, double above, std::span<SunSample> samples) {
  require_as_many(samples.size(), points.size());
  const PointShadow shadow(state_->archive, sun, above);
  std::vector<double> elevations(points.size());
  state_->sample(points, std::span(elevations));
  const auto run = [&] { shadow.sample(points, elevations, state_->sampler, samples); };
  state_->arena ? state_->arena->execute(run) : run();
}

const WorldGeoreference& Surface::georeference() const {
  return state_->georeference;
}

std::string to_string(RestoreMethod method) {
  if (method == RestoreMethod::kPlane) return "plane";
  if (method == RestoreMethod::kAverage) return "average";
  return method == RestoreMethod::kHex ? "hex" : "barycentric";
}

RestoreMethod usual_method(const Metadata& metadata, const SampleGrid& grid) {
  if (are_far_apart(metadata, grid))
    return plane_for(metadata, grid) > 0 ? RestoreMethod::kPlane : RestoreMethod::kAverage;
  return grid.goes_by_places() ? RestoreMethod::kBarycentric : RestoreMethod::kHex;
}

RestoreMethod restore_method_from_string(const std::string& text) {
  if (text == "barycentric") return RestoreMethod::kBarycentric;
  if (text == "hex") return RestoreMethod::kHex;
  if (text == "average") return RestoreMethod::kAverage;
  throw Error(ErrorCode::kInvalidArgument, fmt::format("found '{}', must be hex, barycentric or average", text));
}

struct RowReader::State {
  State(const ArchiveReader& archive, const SampleGrid& its_grid, RestoreMethod method, const Job& job, int plane = 0)
      : grid(its_grid), world(archive.grid()), ground(ground_of(archive.metadata())) {
    const Metadata& metadata = archive.metadata();
    require_samples(grid);
    require_known("the method", method, RestoreMethod::kAverage);
    if (grid.system && !grid.system->map)
      throw Error(ErrorCode::kInvalidArgument, "the grid's reference system has no map; see understand_grid_system()");
    if (method == RestoreMethod::kPlane) plane = plane_for(metadata, grid);
    const TileGrid tiles = metadata.plane_grid(plane);
    if (method == RestoreMethod::kAverage || method == RestoreMethod::kPlane) {
      parts = parts_of(metadata, grid, tiles);
      places = std::make_unique<State>(archive, places_of(grid, parts), RestoreMethod::kBarycentric, job, plane);
      rows_at_once = std::max<std::int64_t>(kSamplesAtOnce / (grid.width * parts.first * parts.second), 1);
      return;
    }
    rows_at_once = std::max<std::int64_t>(kSamplesAtOnce / grid.width, 1);
    outline = SourceOutline::of(metadata);
    if (!grid.goes_by_places()) {
      rows.emplace(tiles, metadata.wraps_x, metadata.quantisation, tiles_of(archive, plane), grid, method,
                   metadata.valid, choose_memory(tiles, method, job), turn_of(metadata));
      return;
    }
    georeference.emplace(metadata);
    if (!georeference->has_geo()) refuse_place("degrees");
    // Rows that bend come back to the same tiles: two rows of them are kept.
    const auto row_bytes = static_cast<std::uint64_t>(2 * tiles.tile_columns() * tiles.shape().stored_vertex_count()) *
                           (metadata.quantisation.type == CodeType::kF32 ? 4 : 2);
    std::uint64_t kept = std::max(kTileBytes, row_bytes);
    if (job.memory_bytes > 0) kept = std::min(kept, std::max(kTileBytes, job.memory_bytes / 2));
    points.emplace(tiles, metadata.quantisation, tiles_of(archive, plane), kept, GroundScale{}, metadata.grid);
  }

  [[nodiscard]] static WorldBounds ground_of(const Metadata& metadata) {
    constexpr double kRounded = 0.01;  // of a sample
    const SourceRecord& source = metadata.source;
    return {0.0, 0.0, metadata.valid.x1 + kRounded * source.spacing_x, metadata.valid.z1 + kRounded * source.spacing_z};
  }

  /// As many rows at once as there is room for.
  ScratchFolder choose_memory(const TileGrid& tiles, RestoreMethod method, const Job& job) {
    const auto bytes = [&](bool in_scratch) {
      return reading_bytes(job, static_cast<double>(tiles.shape().stored_vertex_count())) +
             static_cast<double>(rows_at_once * grid.width) * kSampleBytes +
             GridSampler::memory_bytes(tiles, grid, method, rows_at_once, threads_of(job), in_scratch);
    };
    const auto bound = static_cast<double>(job.bound_bytes());
    if (bound == 0.0) return std::nullopt;
    const double in_memory = bytes(false);
    if (in_memory > bound) {
      rows_at_once = std::min(std::max(kRowsOfScratch, rows_at_once), grid.height);
      while (rows_at_once > 1 && bytes(true) > bound) rows_at_once /= 2;
    }
    return scratch_for(job, in_memory, bytes(true), "this grid");
  }

  /// The place of a sample, whose column may lie between two; NaN where the surface has none.
  [[nodiscard]] WorldPoint world_of(double column, std::int64_t row) const {
    const MapPoint place{grid.first_x + column * grid.spacing_x,
                         grid.first_z - static_cast<double>(row) * grid.spacing_z};
    return georeference->world_from_geo(geo_of(grid, place));
  }

  /// Those of some columns from `first` on: by the cubic through four of them where it meets three others.
  void place_run(std::int64_t first, std::int64_t row, std::span<WorldPoint> at) const {
    const auto last = static_cast<double>(at.size()) - 1.0;
    const auto exact = [&](double column) { return world_of(static_cast<double>(first) + column, row); };
    std::array<WorldPoint, 4> nodes{};
    const auto cubic = [&](double t) {  // 0 to 3
      const std::array<double, 4> weights = {(t - 1.0) * (t - 2.0) * (3.0 - t) / 6.0, t * (t - 2.0) * (t - 3.0) / 2.0,
                                             t * (t - 1.0) * (3.0 - t) / 2.0, t * (t - 1.0) * (t - 2.0) / 6.0};
      WorldPoint sum{0.0, 0.0};
      for (std::size_t i = 0; i < 4; ++i) {
        sum.x += weights[i] * nodes[i].x;
        sum.z += weights[i] * nodes[i].z;
      }
      return sum;
    };
    bool is_close = at.size() > 16;
    if (is_close) {
      for (std::size_t i = 0; i < 4; ++i) nodes[i] = exact(last * static_cast<double>(i) / 3.0);
      for (const double t : {0.5, 1.5, 2.5}) {
        const WorldPoint found = cubic(t);
        const WorldPoint there = exact(last * t / 3.0);
        is_close = is_close && std::abs(found.x - there.x) <= kInterpolated * world.sigma_x() &&
                   std::abs(found.z - there.z) <= kInterpolated * world.sigma_z();
      }
    }
    for (std::size_t c = 0; c < at.size(); ++c) {
      at[c] = is_close ? cubic(3.0 * static_cast<double>(c) / last) : exact(static_cast<double>(c));
    }
  }

  void read_by_places(std::int64_t first, std::int64_t count, std::span<double> elevations) {
    ISOHF_ASSERT(elevations.size() == static_cast<std::size_t>(count * grid.width));
    std::vector<WorldPoint> at(elevations.size());
    const std::int64_t runs = (grid.width + kRun - 1) / kRun;
    oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::int64_t>(0, count * runs, 16), [&](const auto& part) {
      for (std::int64_t run = part.begin(); run < part.end(); ++run) {
        const std::int64_t column = run % runs * kRun;
        const std::int64_t columns = std::min(kRun, grid.width - column);
        place_run(column, first + run / runs,
                  std::span(at).subspan(static_cast<std::size_t>(run / runs * grid.width + column),
                                        static_cast<std::size_t>(columns)));
      }
    });
    points->sample(at, elevations);
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (at[i].x > ground.x1 || at[i].z > ground.z1) elevations[i] = std::numeric_limits<double>::quiet_NaN();
    }
    if (outline) outline->hold(elevations, [&](std::size_t i) { return at[i]; });
  }

  void read_in_world(std::int64_t first, std::int64_t count, std::span<double> elevations) {
    rows->read(first, count, elevations);
    if (!outline) return;
    outline->hold(elevations, [&](std::size_t i) {
      const auto sample = static_cast<std::int64_t>(i);
      return WorldPoint{grid.first_x + static_cast<double>(sample % grid.width) * grid.spacing_x,
                        grid.first_z + static_cast<double>(first + sample / grid.width) * grid.spacing_z};
    });
  }

  /// Sums go from West to East in rows from North to South, however many rows are read at once.
  void average(std::int64_t first, std::int64_t count, std::span<double> elevations) {
    ISOHF_ASSERT(elevations.size() == static_cast<std::size_t>(count * grid.width));
    const auto across = static_cast<std::size_t>(parts.first);
    const std::int64_t at_once = places->rows_at_once;
    std::vector<std::int64_t> counts(elevations.size());
    std::ranges::fill(elevations, 0.0);
    std::vector<double> found;
    for (std::int64_t row = 0; row < count * parts.second; row += at_once) {
      const std::int64_t some = std::min(at_once, count * parts.second - row);
      found.resize(static_cast<std::size_t>(some * grid.width) * across);
      places->read(first * parts.second + row, some, found);
      const auto width = static_cast<std::size_t>(grid.width);
      oneapi::tbb::parallel_for(oneapi::tbb::blocked_range<std::size_t>(0, width, 64), [&](const auto& columns) {
        for (std::int64_t r = 0; r < some; ++r) {
          const double* const of_row = found.data() + static_cast<std::size_t>(r) * width * across;
          const std::size_t into = static_cast<std::size_t>((row + r) / parts.second) * width;
          for (std::size_t column = columns.begin(); column < columns.end(); ++column) {
            for (std::size_t part = 0; part < across; ++part) {
              const double elevation = of_row[column * across + part];
              if (std::isnan(elevation)) continue;
              elevations[into + column] += elevation;
              ++counts[into + column];
            }
          }
        }
      });
    }
    for (std::size_t i = 0; i < counts.size(); ++i) {
      elevations[i] =
          counts[i] > 0 ? elevations[i] / static_cast<double>(counts[i]) : std::numeric_limits<double>::quiet_NaN();
    }
  }

  void read(std::int64_t first, std::int64_t count, std::span<double> elevations) {
    if (places) return average(first, count, elevations);
    rows ? read_in_world(first, count, elevations) : read_by_places(first, count, elevations);
  }

  SampleGrid grid;
  TileGrid world;
  WorldBounds ground;  ///< of the source, and what georeferences are rounded by
  std::int64_t rows_at_once = 1;
  std::int64_t next_row = 0;  ///< the first that may still be read
  GridSize parts = {1, 1};
  std::unique_ptr<State> places;  ///< whose means are the samples
  std::optional<SourceOutline> outline;
  std::optional<GridSampler> rows;  ///< of a grid in world units
  std::optional<WorldGeoreference> georeference;
  std::optional<PointSampler> points;
};

RowReader::RowReader(const ArchiveReader& archive, const SampleGrid& grid, RestoreMethod method, const Job& job)
    : state_(or_out_of_memory(grid_name(grid), [&] { return std::make_unique<State>(archive, grid, method, job); })) {}

RowReader::~RowReader() = default;

void RowReader::read(std::int64_t first, std::int64_t rows, std::span<double> elevations) {
  const SampleGrid& grid = state_->grid;
  if (rows < 0 || first < state_->next_row || first > grid.height || rows > grid.height - first) {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format(
            "{} rows from row {} on are asked for, of {} the first {} are behind; calls come in increasing order", rows,
            first, grid.height, state_->next_row));
  }
  require_as_many(elevations.size(), static_cast<std::size_t>(rows * grid.width));
  state_->next_row = first + rows;
  if (rows == 0) return;
  or_out_of_memory(grid_name(grid), [&] { state_->read(first, rows, elevations); });
}

void RowReader::read_all(const Take& take, const Job& job) {
  require_callback(take);
  const SampleGrid& grid = state_->grid;
  const std::int64_t rows_at_once = state_->rows_at_once;
  Arena(job).execute([&] {
    for (std::int64_t row = 0; row < grid.height; row += rows_at_once) {
      const std::int64_t rows = std::min(rows_at_once, grid.height - row);
      std::vector<double> elevations(static_cast<std::size_t>(rows * grid.width));
      read(row, rows, elevations);
      take(row, elevations);
      job.report({"rows", "rows", row + rows, grid.height});
      job.throw_if_cancelled();
    }
  });
}

}  // namespace isohf
