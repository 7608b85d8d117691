#include "isohf/convert/convert.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/parallel_pipeline.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "isohf/archive/writer.h"
#include "isohf/base/assert.h"
#include "isohf/base/error.h"
#include "isohf/convert/elevation_range.h"
#include "isohf/convert/job_description.h"
#include "isohf/convert/quantiser.h"
#include "isohf/convert/residual_stage.h"
#include "isohf/convert/seed_stage.h"
#include "isohf/convert/texture_stage.h"
#include "isohf/convert/tile_statistics.h"
#include "isohf/surface/band_reader.h"
#include "isohf/surface/edge_range.h"
#include "isohf/surface/source_survey.h"
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
SourceSurvey survey_source(HeightSource& source, EdgeRange& edge, const ProgressCallback& callback,
                           const std::atomic<bool>& cancel) {
  const SourceInfo& info = source.info();
  const std::int64_t step = rows_per_read(info);
  ProgressMeter meter(callback, ConvertProgress::Pass::kRange, info.height);
  SourceSurvey survey(info, false);
  std::vector<std::byte> raw;
  for (std::int64_t row = 0; row < info.height; row += step) {
    throw_if_cancelled(cancel);
    const std::int64_t rows = std::min(step, info.height - row);
    raw.resize(static_cast<std::size_t>(rows * info.width) * size_bytes(info.sample_type));
    source.read_window({0, row, info.width, rows}, raw);
    survey.add(raw);
    edge.add_rows(raw);
    meter.report(row + rows, 0);
  }
  return survey;
}

/// Tiles that are read, made or waiting to be written; fewer where each takes long and brings much along.
constexpr int kTilesInFlightPerThread = 8;
constexpr int kTexturedTilesInFlightPerThread = 2;

/// A tile on its way through the pipeline.
struct TileJob {
  TileIndex index{};
  std::shared_ptr<const Band> band;
  EncodedTile encoded;
  SeedStage::Tile seeds;
  TextureStage::Encoded texture;
};

/// What goes into an archive beside the tiles, made in the same pass; nullptr: not asked for.
struct Stages {
  SeedStage* seeds = nullptr;
  const TextureStage* textures = nullptr;
};

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

/// What one conversion holds constant.
struct Conversion {
  HeightSource& source;
  const ConvertOptions& options;
  const Plan& plan;
  const Kernel kernel;
  const Prefilter prefilter;
  const std::atomic<bool>& cancel;
  double datum = 0.0;
  Quantisation quantisation{};

  [[nodiscard]] SourceAxis axis_x() const {
    const SourceFrame& frame = plan.frame;
    return {frame.width,        frame.first_sample_x, frame.spacing_x,
            frame.registration, plan.outside,         kContinuedSteps * 2.0 * plan.grid.sigma_x()};
  }
  [[nodiscard]] SourceAxis axis_z() const {
    const SourceFrame& frame = plan.frame;
    return {frame.height,       frame.first_sample_z, frame.spacing_z,
            frame.registration, plan.outside,         kContinuedSteps * plan.grid.sigma_z()};
  }
  [[nodiscard]] TileCutter cutter(const ElevationRange& limits) const {
    return {plan.grid, axis_x(), axis_z(), kernel, limits};
  }
};

/// The range of the surface itself, for kernels that leave the range of their samples: cuts every tile, keeps none.
ElevationRange measure_surface(const Conversion& job, const ElevationRange& limits, const ProgressCallback& callback) {
  const TileGrid& grid = job.plan.grid;
  const TileCutter cutter = job.cutter({limits.min - job.datum, limits.max - job.datum});
  BandReader reader(job.source, job.datum, job.prefilter);
  ProgressMeter meter(callback, ConvertProgress::Pass::kRange, grid.tile_rows());
  std::vector<ElevationRange> ranges(static_cast<std::size_t>(grid.tile_columns()), {HUGE_VAL, -HUGE_VAL});
  for (std::int64_t row = 0; row < grid.tile_rows(); ++row) {
    throw_if_cancelled(job.cancel);
    const auto band = reader.read(cutter.rows_needed(row));
    oneapi::tbb::parallel_for(std::int64_t{0}, grid.tile_columns(), [&](std::int64_t column) {
      std::vector<float> heights(static_cast<std::size_t>(grid.shape().stored_vertex_count()));
      cutter.cut({column, row}, band->view(), heights);
      ElevationRange& range = ranges[static_cast<std::size_t>(column)];
      for (const float height : heights) {
        const double elevation = double{height} + job.datum;  // NaN compares false
        range.min = elevation < range.min ? elevation : range.min;
        range.max = elevation > range.max ? elevation : range.max;
      }
    });
    meter.report(row + 1, 0);
  }
  ElevationRange all{HUGE_VAL, -HUGE_VAL};
  for (const ElevationRange& range : ranges) {
    all = {std::min(all.min, range.min), std::max(all.max, range.max)};
  }
  return all.min <= all.max ? all : ElevationRange{};
}

/// First pass and what follows from it: datum, scale and offset.
void choose_codes(Conversion& job, std::vector<std::string>& warnings, const ProgressCallback& progress) {
  const SourceInfo& info = job.source.info();
  const QuantisationRequest request{job.options.code_type, job.options.step};
  if (job.options.z_range) {
    const ElevationRange range{job.options.z_range->first, job.options.z_range->second};
    job.datum = choose_datum(info, range);
    job.quantisation = choose_quantisation(request, range, info);
    return;
  }
  EdgeRange edge(info, job.axis_x().continued_samples(), job.axis_z().continued_samples());
  const SourceSurvey survey = survey_source(job.source, edge, progress, job.cancel);
  SourceScan found = survey.scan();
  if (found.valid == 0) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: all {} samples are void or not finite, there is no elevation to convert", info.path,
                            found.voids));
  }
  warn_of_unit_range(info, found.range, warnings);
  if (const std::string warning = survey.warning(); !warning.empty()) warnings.push_back(info.path + ": " + warning);
  job.datum = choose_datum(info, found.range);
  if (job.plan.outside == Outside::kCover) found.range = edge.widen(found.range);
  job.quantisation = choose_quantisation(request, found.range, info);
  const double over = overshoot(job.kernel, job.prefilter);
  if (over == 0.0 || job.options.code_type == CodeType::kF32) return;
  // The surface may leave the samples' range. Where the codes reach far enough for the worst case at the same step,
  // nothing needs to be measured; voids, at which weights are renormalised, have no such bound.
  const bool has_step = request.step ? *request.step != 0.0 : !is_floating(info.sample_type);
  const ElevationRange reach = widened(found.range, over);
  if (found.voids == 0 && has_step && has_codes_for(job.quantisation, reach)) {
    job.quantisation = choose_quantisation({request.type, job.quantisation.scale}, reach, info);
    return;
  }
  job.quantisation = choose_quantisation(request, measure_surface(job, found.range, progress), info);
}

[[noreturn]] void refuse_overflow(const Conversion& job, TileIndex tile, const QuantiserCounts& counts) {
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("tile ({},{}): {} elevations lie outside the z range {} to {}; widen --z-range, or give "
                          "--clamp-range to move them to its ends",
                          tile.column, tile.row, counts.below + counts.above, job.quantisation.offset,
                          elevation_from_code(job.quantisation, job.quantisation.max_code())));
}

void make_tile(const Conversion& job, const TileCutter& cutter, const Stages& stages, bool is_new, TileJob& tile) {
  const TileShape& shape = job.plan.grid.shape();
  std::vector<float> heights(static_cast<std::size_t>(shape.stored_vertex_count()));
  cutter.cut(tile.index, tile.band->view(), heights);
  TileCodes codes;
  const QuantiserCounts counts = quantise(job.quantisation, job.datum, heights, codes);
  if (counts.below + counts.above > 0 && !job.options.clamp_range) refuse_overflow(job, tile.index, counts);
  EncodedTile& encoded = tile.encoded;
  encoded = encode_tile(shape, codes);
  encoded.statistics = tile_statistics(shape, codes, job.quantisation);
  encoded.statistics.clamped = counts.below + counts.above;
  encoded.statistics.worst_rounding = counts.worst_rounding;
  if (stages.seeds != nullptr) tile.seeds = stages.seeds->prepare(codes);
  tile.seeds.is_empty = encoded.is_empty;
  if (stages.textures != nullptr && is_new && !encoded.is_empty) tile.texture = stages.textures->encode(tile.index);
}

/// Second pass: read -> resample and encode -> write in order. The number of tiles in flight is fixed, and so is the
/// number of bands: one that is being cut and one that is being read.
void write_tiles(const Conversion& job, ArchiveWriter& writer, const Stages& stages, const ProgressCallback& callback,
                 std::size_t tiles_in_flight) {
  const TileGrid& grid = job.plan.grid;
  const Quantisation& codes = job.quantisation;
  ElevationRange limits{-HUGE_VAL, HUGE_VAL};
  if (codes.type != CodeType::kF32) {
    limits = {codes.offset - job.datum, elevation_from_code(codes, codes.max_code()) - job.datum};
  }
  const TileCutter cutter = job.cutter(limits);
  BandReader reader(job.source, job.datum, job.prefilter);
  ProgressMeter meter(callback, ConvertProgress::Pass::kTiles, grid.tile_count());
  const std::int64_t first_new = writer.next_tile();
  std::int64_t next = stages.seeds != nullptr ? SeedStage::first_tile_needed(grid, first_new) : first_new;
  std::int64_t band_row = -1;
  std::shared_ptr<const Band> band;

  // Tiles leave the pipeline in the order in which they enter it, so that a ring of as many as may be in flight always
  // has the next one free. The pipeline itself only hands on pointers: it forgets to destroy what it holds when a stage
  // throws.
  std::vector<TileJob> ring(tiles_in_flight);
  std::size_t entered = 0;

  const auto read = [&](oneapi::tbb::flow_control& control) -> TileJob* {
    throw_if_cancelled(job.cancel);
    if (next == grid.tile_count()) {
      band.reset();
      control.stop();
      return nullptr;
    }
    TileJob* tile = &ring[entered++ % ring.size()];
    *tile = {};
    tile->index = grid.tile_at(next++);
    if (tile->index.row != band_row) {
      band.reset();
      band = reader.read(cutter.rows_needed(tile->index.row));
      band_row = tile->index.row;
    }
    tile->band = band;
    return tile;
  };
  const auto encode = [&](TileJob* tile) {
    make_tile(job, cutter, stages, grid.flat_index(tile->index) >= first_new, *tile);
    tile->band.reset();
    return tile;
  };
  std::int64_t written = next;
  const auto write = [&](TileJob* tile) {
    if (written >= first_new) {
      if (stages.textures != nullptr) stages.textures->add(tile->index, tile->texture, writer);
      writer.add_tile(tile->encoded);
    }
    if (stages.seeds != nullptr) stages.seeds->add(tile->index, std::move(tile->seeds), writer);
    meter.report(++written, writer.bytes_written());
  };

  using oneapi::tbb::filter_mode;
  using oneapi::tbb::make_filter;
  oneapi::tbb::parallel_pipeline(ring.size(), make_filter<void, TileJob*>(filter_mode::serial_in_order, read) &
                                                  make_filter<TileJob*, TileJob*>(filter_mode::parallel, encode) &
                                                  make_filter<TileJob*, void>(filter_mode::serial_in_order, write));
}

void check_range(const std::pair<double, double>& range) {
  if (!(std::isfinite(range.first) && std::isfinite(range.second) && range.first < range.second)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("--z-range is {}:{}, must be two numbers, the smaller first", range.first, range.second));
  }
}

/// What bands take beyond plain heights: coefficients, a byte a sample that tells voids, and a halo on either side;
/// while the next band is made the last one is still there.
std::uint64_t prefilter_memory_bytes(const SourceInfo& info, const Plan& plan, const Prefilter& prefilter) {
  if (prefilter.is_identity()) return 0;
  const double band_rows = plan.grid.shape().rows() * plan.grid.sigma_z() / plan.frame.spacing_z + 16.0;
  const double rows = std::min(band_rows + 4.0 * prefilter.halo(), 2.0 * static_cast<double>(info.height));
  return static_cast<std::uint64_t>(6.0 * rows * static_cast<double>(info.width));
}

}  // namespace

ConvertSummary convert(HeightSource& source, const std::string& output, const ConvertOptions& options,
                       const ProgressCallback& progress, const std::atomic<bool>& cancel) {
  const auto start = std::chrono::steady_clock::now();
  const SourceInfo& info = source.info();
  const Plan plan = make_plan(info, options.plan);
  if (options.z_range) check_range(*options.z_range);
  if (options.shadow_seeds) check_seed_request(*options.shadow_seeds, plan.grid);
  const int threads = options.threads > 0 ? options.threads : oneapi::tbb::this_task_arena::max_concurrency();
  const int tiles_in_flight = threads * (options.texture ? kTexturedTilesInFlightPerThread : kTilesInFlightPerThread);
  const std::optional<TextureStage> textures =
      options.texture ? std::optional(TextureStage::make(plan, info, *options.texture, threads, tiles_in_flight))
                      : std::nullopt;
  const Kernel kernel = Kernel::make(filter_from_string(options.filter));
  Prefilter prefilter = Prefilter::make(kernel.filter(), acquisition_from_string(options.acquisition));
  const std::uint64_t memory_bytes = plan.estimated_memory_bytes + prefilter_memory_bytes(info, plan, prefilter) +
                                     (options.shadow_seeds ? seed_stage_memory_bytes(plan.grid) : 0) +
                                     (options.lossless ? residual_stage_memory_bytes(info, plan, threads) : 0) +
                                     (textures ? textures->memory_bytes() : 0);
  if (options.memory_bytes != 0 && memory_bytes > options.memory_bytes) {
    throw Error(ErrorCode::kOutOfMemory,
                fmt::format("this conversion needs about {} MB, --memory allows {} MB; use smaller tiles (--shape, "
                            "--triangles) or allow more",
                            memory_bytes / 1000000, options.memory_bytes / 1000000));
  }
  const oneapi::tbb::global_control workers(oneapi::tbb::global_control::max_allowed_parallelism,
                                            static_cast<std::size_t>(threads));

  ArchiveWriter writer(output, plan.grid,
                       {options.overwrite, options.resume, job_fingerprint(info, plan, options),
                        metadata_room(describe_job(info, plan, options, {}))});
  ConvertSummary summary(plan.grid);
  summary.warnings = info.warnings;
  if (textures)
    summary.warnings.insert(summary.warnings.end(), textures->warnings().begin(), textures->warnings().end());
  Conversion job{source, options, plan, kernel, std::move(prefilter), cancel};
  std::optional<SeedStage> seeds;
  std::optional<LosslessRecord> lossless;
  try {
    oneapi::tbb::task_arena arena(threads);
    arena.execute([&] {
      choose_codes(job, summary.warnings, progress);
      if (options.shadow_seeds) {
        // Lengths of both kinds are compared as metres where both are known to be.
        const bool known = plan.frame.in_metres && !info.vertical_unit.empty();
        seeds.emplace(plan.grid, job.quantisation, *options.shadow_seeds,
                      known ? 1.0 / info.metres_per_vertical_unit : 1.0);
      }
      write_tiles(job, writer, {seeds ? &*seeds : nullptr, textures ? &*textures : nullptr}, progress,
                  static_cast<std::size_t>(tiles_in_flight));
      if (options.lossless) {
        ProgressMeter meter(progress, ConvertProgress::Pass::kResiduals, info.height);
        lossless = write_residuals(
            source, plan.frame, plan.grid, job.quantisation, writer,
            [&](std::int64_t rows) { meter.report(rows, writer.bytes_written()); }, cancel);
      }
    });

    const TileStatistics all = writer.statistics();
    if (all.voids == all.vertices) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("{}: every one of the {} lattice vertices is void, nothing to write", info.path, all.vertices));
    }
    summary.metadata = describe_job(info, plan, options, job.quantisation);
    summary.metadata.statistics = total_statistics(all);
    if (seeds) {
      const ShadowSeedInfo record = seeds->info(writer);
      summary.seed_bytes = record.bytes;
      summary.metadata.extensions.emplace_back(kShadowSeedsName, format_shadow_seed_info(record));
    }
    if (textures) {
      summary.texture = textures->info(writer);
      summary.texture_bytes = summary.texture->bytes;
      summary.pixels_per_texel = textures->pixels_per_texel();
      summary.metadata.textures = {texture_name_pattern(summary.texture->format)};
      summary.metadata.extensions.emplace_back(kTileTexturesName, format_texture_info(*summary.texture));
    }
    if (lossless) summary.metadata.extensions.emplace_back(kLosslessName, format_lossless(*lossless));
    summary.residual_bytes = lossless ? lossless->residual_bytes : 0;
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
  summary.tile_bytes = writer.tile_bytes();
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
