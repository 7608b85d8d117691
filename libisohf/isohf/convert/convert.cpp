#include "isohf/convert/convert.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_pipeline.h>
#include <oneapi/tbb/task_arena.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>

#include "isohf/archive/writer.h"
#include "isohf/base/assert.h"
#include "isohf/base/error.h"
#include "isohf/convert/quantiser.h"
#include "isohf/surface/band_reader.h"
#include "isohf/surface/source_scan.h"
#include "isohf/surface/tile_cutter.h"

namespace isohf {
namespace {

using ProgressCallback = std::function<void(const ConvertProgress&)>;

/// Calls back at most ten times a second, and at the end of a pass.
class ProgressMeter {
 public:
  ProgressMeter(const ProgressCallback& callback, ConvertProgress::Pass pass, std::int64_t total)
      : callback_(callback) {
    progress_.pass = pass;
    progress_.total = total;
  }

  void report(std::int64_t done, std::uint64_t bytes_written) {
    if (!callback_) return;
    const auto now = std::chrono::steady_clock::now();
    if (done < progress_.total && now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    progress_.done = done;
    progress_.bytes_written = bytes_written;
    callback_(progress_);
  }

 private:
  const ProgressCallback& callback_;
  ConvertProgress progress_;
  std::chrono::steady_clock::time_point last_{};
};

void throw_if_cancelled(const std::atomic<bool>& cancel) {
  if (cancel.load(std::memory_order_relaxed)) throw Error(ErrorCode::kCancelled, "interrupted");
}

/// First pass: range and counts of the whole source.
SourceScan scan_source(HeightSource& source, const ProgressCallback& callback, const std::atomic<bool>& cancel) {
  const SourceInfo& info = source.info();
  const std::int64_t step = rows_per_read(info);
  ProgressMeter meter(callback, ConvertProgress::Pass::kRange, info.height);
  SourceScan found;
  std::vector<std::byte> raw;
  for (std::int64_t row = 0; row < info.height; row += step) {
    throw_if_cancelled(cancel);
    const std::int64_t rows = std::min(step, info.height - row);
    raw.resize(static_cast<std::size_t>(rows * info.width) * size_bytes(info.sample_type));
    source.read_window({0, row, info.width, rows}, raw);
    scan_samples(info, raw, found);
    meter.report(row + rows, 0);
  }
  return found;
}

/// Everything that decides the bytes of the archive, as text: two runs with the same fingerprint may continue each
/// other.
std::string fingerprint_of(const SourceInfo& info, const Plan& plan, const ConvertOptions& options) {
  std::error_code ignored;
  const auto size = std::filesystem::file_size(info.path, ignored);
  struct stat status {};
  const bool known = ::stat(info.path.c_str(), &status) == 0;
  const TileShape& shape = plan.grid.shape();
  return fmt::format(
      "{} | {} {} bytes {}.{:09} {}x{} {} channel '{}' scale {} {} void {} | shape {}x{}/{} tiles {}x{} extent {} {} "
      "first {} {} "
      "spacing {} {} {} | {} range {} step {} clamp {} | {} {}",
      options.producer, std::filesystem::path(info.path).filename().string(), ignored ? 0 : size,
      known ? status.st_mtim.tv_sec : 0, known ? status.st_mtim.tv_nsec : 0, info.width, info.height,
      to_string(info.sample_type), info.channel, info.z_scale, info.z_offset,
      info.void_values.empty() ? std::string("none") : fmt::format("{}", info.void_values.front()), shape.columns(),
      shape.rows(), shape.levels(), plan.grid.tile_columns(), plan.grid.tile_rows(), plan.grid.extent_x(),
      plan.grid.extent_z(), plan.frame.first_sample_x, plan.frame.first_sample_z, plan.frame.spacing_x,
      plan.frame.spacing_z, to_string(plan.outside), to_string(options.code_type),
      options.z_range ? fmt::format("{}:{}", options.z_range->first, options.z_range->second) : "data",
      options.step ? fmt::format("{}", *options.step) : "auto", options.clamp_range, options.filter,
      options.acquisition);
}

SourceRecord record_of(const SourceInfo& info, const SourceFrame& frame) {
  const Georeference& place = info.georeference;
  SourceRecord record;
  record.name = std::filesystem::path(info.path).filename().string();
  record.format = info.format;
  record.width = info.width;
  record.height = info.height;
  record.sample_type = to_string(info.sample_type);
  record.channel = info.channel;
  record.registration = to_string(frame.registration);
  record.first_sample_x = frame.first_sample_x;
  record.first_sample_z = frame.first_sample_z;
  record.spacing_x = frame.spacing_x;
  record.spacing_z = frame.spacing_z;
  if (place.has_origin) {
    record.origin_x = place.origin_x;
    record.origin_y = place.origin_y;
  }
  record.crs_unit = place.unit == HorizontalUnit::kMetre    ? "metre"
                    : place.unit == HorizontalUnit::kDegree ? "degree"
                                                            : "unknown";
  if (place.has_origin || place.unit != HorizontalUnit::kUnknown) {
    record.crs_spacing_x = place.spacing_x;
    record.crs_spacing_y = place.spacing_y;
  }
  record.crs_name = place.system.name;
  record.crs_epsg = place.system.epsg;
  record.crs_wkt = place.system.wkt;
  record.body = place.system.body;
  record.semi_major_axis_m = place.system.semi_major_axis_m;
  record.inverse_flattening = place.system.inverse_flattening;
  record.vertical_datum = place.system.vertical_datum;
  record.vertical_epsg = place.system.vertical_epsg;
  return record;
}

/// Statistics of one tile over its visible vertices.
TileStatistics statistics_of(const TileShape& shape, const TileCodes& tile, const Quantisation& quantisation) {
  TileStatistics statistics;
  const auto add = [&](double elevation, bool is_void) {
    ++statistics.vertices;
    if (is_void) {
      ++statistics.voids;
      return;
    }
    statistics.sum += elevation;
    statistics.min = std::min(statistics.min, elevation);
    statistics.max = std::max(statistics.max, elevation);
  };
  for (int r = 1; r <= shape.rows() - 2; ++r) {
    const int last = shape.columns() - (r % 2 == 0 ? 2 : 3);
    const std::size_t row = static_cast<std::size_t>(r) * static_cast<std::size_t>(shape.columns());
    if (tile.type == CodeType::kF32) {
      for (int c = 1; c <= last; ++c) {
        const float height = tile.heights[row + static_cast<std::size_t>(c)];
        add(double{height}, std::isnan(height));
      }
      continue;
    }
    // Codes are summed as integers: no rounding, and the loop vectorises.
    std::uint64_t sum = 0;
    std::uint32_t low = 0xFFFFFFFFU;
    std::uint32_t high = 0;
    std::int64_t voids = 0;
    for (int c = 1; c <= last; ++c) {
      const std::uint32_t code = tile.codes[row + static_cast<std::size_t>(c)];
      const bool is_void = code == quantisation.void_code();
      voids += is_void ? 1 : 0;
      sum += is_void ? 0U : code;
      low = !is_void && code < low ? code : low;
      high = !is_void && code > high ? code : high;
    }
    statistics.vertices += last;
    statistics.voids += voids;
    if (voids == last) continue;
    statistics.sum +=
        quantisation.offset * static_cast<double>(last - voids) + quantisation.scale * static_cast<double>(sum);
    statistics.min = std::min(statistics.min, elevation_from_code(quantisation, low));
    statistics.max = std::max(statistics.max, elevation_from_code(quantisation, high));
  }
  return statistics;
}

/// A tile on its way through the pipeline.
struct TileJob {
  TileIndex index{};
  std::shared_ptr<const Band> band;
  EncodedTile encoded;
};

/// What one conversion holds constant.
struct Conversion {
  HeightSource& source;
  const ConvertOptions& options;
  const Plan& plan;
  Quantisation quantisation;
  double datum;
  const std::atomic<bool>& cancel;
};

[[noreturn]] void refuse_overflow(const Conversion& job, TileIndex tile, const QuantiserCounts& counts) {
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("tile ({},{}): {} elevations lie outside the z range {} to {}; widen --z-range, or give "
                          "--clamp-range to move them to its ends",
                          tile.column, tile.row, counts.below + counts.above, job.quantisation.offset,
                          elevation_from_code(job.quantisation, job.quantisation.max_code())));
}

EncodedTile make_tile(const Conversion& job, const TileCutter& cutter, TileIndex index, const Band& band) {
  const TileShape& shape = job.plan.grid.shape();
  std::vector<float> heights(static_cast<std::size_t>(shape.stored_vertex_count()));
  cutter.cut(index, band.view(), heights);
  TileCodes codes;
  const QuantiserCounts counts = quantise(job.quantisation, job.datum, heights, codes);
  if (counts.below + counts.above > 0 && !job.options.clamp_range) refuse_overflow(job, index, counts);
  EncodedTile encoded = encode_tile(shape, codes);
  encoded.statistics = statistics_of(shape, codes, job.quantisation);
  encoded.statistics.clamped = counts.below + counts.above;
  encoded.statistics.worst_rounding = counts.worst_rounding;
  return encoded;
}

/// Second pass: read -> resample and encode -> write in order. The number of tiles in flight is fixed, and so is the
/// number of bands: one that is being cut and one that is being read.
void write_tiles(const Conversion& job, ArchiveWriter& writer, const ProgressCallback& callback, int threads) {
  const TileGrid& grid = job.plan.grid;
  const SourceFrame& frame = job.plan.frame;
  const TileCutter cutter(
      grid, SourceAxis(frame.width, frame.first_sample_x, frame.spacing_x, frame.registration, job.plan.outside),
      SourceAxis(frame.height, frame.first_sample_z, frame.spacing_z, frame.registration, job.plan.outside),
      Kernel::make(filter_from_string(job.options.filter)));
  BandReader reader(job.source, job.datum);
  ProgressMeter meter(callback, ConvertProgress::Pass::kTiles, grid.tile_count());
  std::int64_t next = writer.next_tile();
  std::int64_t band_row = -1;
  std::shared_ptr<const Band> band;

  const auto read = [&](oneapi::tbb::flow_control& control) -> std::shared_ptr<TileJob> {
    throw_if_cancelled(job.cancel);
    if (next == grid.tile_count()) {
      band.reset();
      control.stop();
      return nullptr;
    }
    auto tile = std::make_shared<TileJob>();
    tile->index = grid.tile_at(next++);
    if (tile->index.row != band_row) {
      band.reset();
      band = reader.read(cutter.rows_needed(tile->index.row));
      band_row = tile->index.row;
    }
    tile->band = band;
    return tile;
  };
  const auto encode = [&](std::shared_ptr<TileJob> tile) {
    tile->encoded = make_tile(job, cutter, tile->index, *tile->band);
    tile->band.reset();
    return tile;
  };
  std::int64_t written = next;
  const auto write = [&](const std::shared_ptr<TileJob>& tile) {
    writer.add_tile(tile->encoded);
    meter.report(++written, writer.bytes_written());
  };

  constexpr std::size_t kTilesInFlightPerThread = 8;
  using oneapi::tbb::filter_mode;
  using oneapi::tbb::make_filter;
  oneapi::tbb::parallel_pipeline(
      static_cast<std::size_t>(threads) * kTilesInFlightPerThread,
      make_filter<void, std::shared_ptr<TileJob>>(filter_mode::serial_in_order, read) &
          make_filter<std::shared_ptr<TileJob>, std::shared_ptr<TileJob>>(filter_mode::parallel, encode) &
          make_filter<std::shared_ptr<TileJob>, void>(filter_mode::serial_in_order, write));
}

Metadata describe(const Conversion& job, const SourceInfo& info) {
  Metadata metadata(job.plan.grid);
  metadata.quantisation = job.quantisation;
  metadata.horizontal_unit = job.plan.frame.in_metres ? "metre" : "unknown";
  metadata.vertical_unit = info.vertical_unit.empty() ? "unknown" : info.vertical_unit;
  metadata.valid = job.plan.frame.bounds();
  metadata.valid.x1 = std::min(metadata.valid.x1, job.plan.grid.world_width());
  metadata.valid.z1 = std::min(metadata.valid.z1, job.plan.grid.world_height());
  metadata.outside = to_string(job.plan.outside);
  metadata.filter = job.options.filter;
  metadata.acquisition = job.options.acquisition;
  metadata.source = record_of(info, job.plan.frame);
  metadata.producer = job.options.producer;
  return metadata;
}

Statistics totals(const TileStatistics& all) {
  Statistics statistics;
  statistics.vertices = all.vertices;
  statistics.voids = all.voids;
  statistics.clamped = all.clamped;
  statistics.worst_rounding = all.worst_rounding;
  if (all.voids < all.vertices) {
    statistics.min = all.min;
    statistics.max = all.max;
    statistics.mean = all.sum / static_cast<double>(all.vertices - all.voids);
  }
  return statistics;
}

/// Elevations 0 to 1 in floats or scaled integers are most often a fraction of something.
void warn_of_unit_range(const SourceInfo& info, const ElevationRange& range, std::vector<std::string>& warnings) {
  if (!is_floating(info.sample_type) || info.z_scale != 1.0 || info.z_offset != 0.0) return;
  if (range.min >= -0.1 && range.max <= 1.1 && range.max > range.min) {
    warnings.push_back(
        fmt::format("{}: elevations run from {:.4g} to {:.4g}, which looks like a fraction of a height, not "
                    "metres; give --z-scale and --z-offset",
                    info.path, range.min, range.max));
  }
}

void check_range(const std::pair<double, double>& range) {
  if (!(std::isfinite(range.first) && std::isfinite(range.second) && range.first < range.second)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("--z-range is {}:{}, must be two numbers, the smaller first", range.first, range.second));
  }
}

}  // namespace

ConvertSummary convert(HeightSource& source, const std::string& output, const ConvertOptions& options,
                       const ProgressCallback& progress, const std::atomic<bool>& cancel) {
  const auto start = std::chrono::steady_clock::now();
  const SourceInfo& info = source.info();
  const Plan plan = make_plan(info, options.plan);
  if (options.z_range) check_range(*options.z_range);
  if (options.memory_bytes != 0 && plan.estimated_memory_bytes > options.memory_bytes) {
    throw Error(ErrorCode::kOutOfMemory,
                fmt::format("this conversion needs about {} MB, --memory allows {} MB; use smaller tiles (--shape, "
                            "--triangles) or allow more",
                            plan.estimated_memory_bytes / 1000000, options.memory_bytes / 1000000));
  }
  const int threads = options.threads > 0 ? options.threads : oneapi::tbb::this_task_arena::max_concurrency();
  const oneapi::tbb::global_control workers(oneapi::tbb::global_control::max_allowed_parallelism,
                                            static_cast<std::size_t>(threads));

  ArchiveWriter writer(output, plan.grid, {options.overwrite, options.resume, fingerprint_of(info, plan, options)});
  ConvertSummary summary(plan.grid);
  summary.warnings = info.warnings;
  try {
    ElevationRange range{0.0, 0.0};
    if (options.z_range) {
      range = {options.z_range->first, options.z_range->second};
    } else {
      const SourceScan found = scan_source(source, progress, cancel);
      if (found.valid == 0) {
        throw Error(ErrorCode::kInvalidArgument,
                    fmt::format("{}: all {} samples are void or not finite, there is no elevation to convert",
                                info.path, found.voids));
      }
      range = found.range;
      warn_of_unit_range(info, range, summary.warnings);
    }
    Conversion job{source,
                   options,
                   plan,
                   choose_quantisation({options.code_type, options.step}, range, info),
                   choose_datum(info, range),
                   cancel};
    oneapi::tbb::task_arena arena(threads);
    arena.execute([&] { write_tiles(job, writer, progress, threads); });

    const TileStatistics all = writer.statistics();
    if (all.voids == all.vertices) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("{}: every one of the {} lattice vertices is void, nothing to write", info.path, all.vertices));
    }
    summary.metadata = describe(job, info);
    summary.metadata.statistics = totals(all);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kCancelled) writer.keep_part();
    throw;
  }
  summary.tiles_expected = plan.grid.tile_count();
  summary.tiles_written = writer.next_tile();
  summary.tiles_void = summary.tiles_written - writer.tiles_stored();
  if (summary.tiles_written != summary.tiles_expected) {
    throw Error(ErrorCode::kIo, fmt::format("{}: {} tiles written, {} expected", output, summary.tiles_written,
                                            summary.tiles_expected));
  }
  summary.archive_bytes = writer.finish(summary.metadata);
  summary.metadata.tiles_stored = writer.tiles_stored();
  summary.source_samples = static_cast<std::uint64_t>(info.width) * static_cast<std::uint64_t>(info.height);
  summary.lattice_samples = static_cast<std::uint64_t>(plan.lattice_samples);
  summary.step = summary.metadata.quantisation.type == CodeType::kF32 ? 0.0 : summary.metadata.quantisation.scale;
  summary.worst_rounding = summary.metadata.statistics.worst_rounding;
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return summary;
}

}  // namespace isohf
