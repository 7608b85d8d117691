#include "isohf/convert/run_conversion.h"

#include "isohf/archive/tile/tile_encoder.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_pipeline.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile_statistics.h"
#include "isohf/archive/writer.h"
#include "isohf/base/arena.h"
#include "isohf/base/assert.h"
#include "isohf/base/handed_in.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/job_description.h"
#include "isohf/convert/memory_plan.h"
#include "isohf/convert/stages/choose_quantisation.h"
#include "isohf/convert/stages/code_source.h"
#include "isohf/convert/stages/plane_stage.h"
#include "isohf/convert/stages/residual_stage.h"
#include "isohf/convert/stages/seed_stage.h"
#include "isohf/convert/stages/texture_stage.h"
#include "isohf/convert/stages/tiles_around.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Elevations of one tile beyond the limits.
struct Outliers {
  std::int64_t vertices = 0;  ///< of all that are stored
  std::int64_t counted = 0;   ///< of these, those that statistics count
  GridVertex worst{};
  double elevation = 0.0;  ///< of the worst
};

/// A tile on its way through the pipeline.
struct TileJob {
  TileIndex index{};
  CodeSource::Part part;
  EncodedTile encoded;
  Outliers outliers;
  std::vector<std::unique_ptr<Stage::Made>> made;  ///< by stage
};

using Stages = std::vector<std::unique_ptr<Stage>>;

Outliers find_outliers(const CountedVertices& counted, TileIndex tile, const CodeLimits& limits, double datum,
                       std::span<const float> heights) {
  Outliers found;
  const TileShape& shape = counted.shape();
  // Resampled level ground is level but for the rounding of floats.
  const double largest = std::max(std::abs(limits.lowest), std::abs(limits.highest)) + std::abs(datum);
  double worst = 4.0 * largest * double{std::numeric_limits<float>::epsilon()};
  const double rounding = worst;
  std::size_t i = 0;
  for (int r = 0; r < shape.rows(); ++r) {
    const bool is_padding = r == 0 || r + 1 == shape.rows();
    const CountedVertices::Columns columns = is_padding ? CountedVertices::Columns{1, 0} : counted.of_row(tile, r);
    for (int c = 0; c < shape.columns(); ++c) {
      const double elevation = double{heights[i++]} + datum;
      const double beyond = std::max(limits.lowest - elevation, elevation - limits.highest);  // NaN compares false
      if (!(beyond > rounding)) continue;
      ++found.vertices;
      found.counted += c >= columns.first && c <= columns.last ? 1 : 0;
      if (beyond <= worst) continue;
      worst = beyond;
      found.worst = {c, r};
      found.elevation = elevation;
    }
  }
  return found;
}

[[noreturn]] void refuse_outliers(const Conversion& conversion, TileIndex tile, const Outliers& outliers) {
  const TileGrid& grid = conversion.plan.grid;
  const WorldPoint place = grid.world_from_lattice(grid.lattice_vertex(tile, outliers.worst));
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: elevation {:.9g} at x {:.9g} z {:.9g}, in tile ({},{}), lies outside `z_range` {}:{}, "
                          "and {} more of the tile; widen the range, or give `clamp_range` to move them to its ends",
                          conversion.source.info().path, outliers.elevation, place.x, place.z, tile.column, tile.row,
                          conversion.limits.lowest, conversion.limits.highest, outliers.vertices - 1));
}

/// A tile over nothing but voids, made once for all.
struct VoidTile {
  TileCodes codes;
  EncodedTile encoded;

  explicit VoidTile(const Conversion& conversion)
      : codes(void_tile(conversion.plan.grid.shape(), conversion.quantisation)),
        encoded(encode_tile(conversion.plan.grid.shape(), codes, conversion.options.effort)) {}
};

/// Second pass over the source: read -> resample and encode -> write in order. The number of tiles in flight is fixed.
class TilePass {
 public:
  TilePass(const Conversion& conversion, ArchiveWriter& writer, const Stages& stages)
      : conversion_(conversion),
        writer_(writer),
        stages_(stages),
        source_(conversion),
        counted_(describe_job(conversion.source.info(), conversion.plan, conversion.options, conversion.quantisation)),
        nothing_(conversion),
        first_new_(writer.next_tile()) {
    for (const auto& stage : stages) first_.push_back(std::max(stage->first_tile(first_new_), conversion.first_tile));
  }

  void run() {
    const TileGrid& grid = conversion_.plan.grid;
    // Tiles leave the pipeline in the order in which they enter it, so that a ring of as many as may be in flight always
    // has the next one free. The pipeline itself only hands on pointers: it forgets to destroy what it holds when a stage
    // throws.
    std::vector<TileJob> ring(conversion_.memory.tiles_in_flight);
    std::size_t entered = 0;
    std::int64_t next = first_new_;
    for (const std::int64_t first : first_) next = std::min(next, first);
    const auto read = [&](oneapi::tbb::flow_control& control) -> TileJob* {
      conversion_.job.throw_if_cancelled();
      if (next == conversion_.end_tile) {
        control.stop();
        return nullptr;
      }
      TileJob* tile = &ring[entered++ % ring.size()];
      *tile = {};
      tile->index = grid.tile_at(next++);
      tile->part = source_.read(tile->index);
      return tile;
    };
    const auto encode = [&](TileJob* tile) {
      make(*tile);
      tile->part = {};
      return tile;
    };
    using oneapi::tbb::filter_mode;
    using oneapi::tbb::make_filter;
    oneapi::tbb::parallel_pipeline(ring.size(), make_filter<void, TileJob*>(filter_mode::serial_in_order, read) &
                                                    make_filter<TileJob*, TileJob*>(filter_mode::parallel, encode) &
                                                    make_filter<TileJob*, void>(filter_mode::serial_in_order,
                                                                                [&](TileJob* tile) { write(*tile); }));
    for (std::int64_t flat = conversion_.end_tile; flat < grid.tile_count(); ++flat) {
      for (const auto& stage : stages_) stage->pass_over(grid.tile_at(flat));
    }
    writer_.skip_tiles(grid.tile_count() - conversion_.end_tile);
  }

 private:
  /// Any thread.
  void make(TileJob& tile) {
    std::vector<float> heights;
    TileCodes codes;
    const std::optional<QuantiserCounts> counts = source_.cut(tile.index, tile.part, heights, codes);
    if (!counts) {
      tile.encoded = nothing_.encoded;
      tile.encoded.statistics = void_statistics(counted_, tile.index);
      return make_beside(nothing_.codes, tile);
    }
    // Without a range from the user the codes reach over all that there is.
    if (conversion_.options.z_range || counts->below + counts->above > 0) {
      tile.outliers = find_outliers(counted_, tile.index, conversion_.limits, conversion_.datum, heights);
    }
    EncodedTile& encoded = tile.encoded;
    encoded = encode_tile(conversion_.plan.grid.shape(), codes, conversion_.options.effort);
    encoded.statistics = tile_statistics(counted_, tile.index, codes, conversion_.quantisation);
    encoded.statistics.clamped = tile.outliers.counted;
    encoded.statistics.worst_rounding = counts->worst_rounding;
    make_beside(codes, tile);
  }

  void make_beside(const TileCodes& codes, TileJob& tile) const {
    const std::int64_t flat = conversion_.plan.grid.flat_index(tile.index);
    for (std::size_t i = 0; i < stages_.size(); ++i) {
      tile.made.push_back(flat < first_[i] ? nullptr : stages_[i]->make(tile.index, codes, tile.encoded));
    }
  }

  /// In flat order.
  void write(const TileJob& tile) {
    if (tile.outliers.vertices > 0 && !conversion_.options.clamp_range)
      refuse_outliers(conversion_, tile.index, tile.outliers);
    const std::int64_t flat = conversion_.plan.grid.flat_index(tile.index);
    const auto hand_on = [&](auto add) {
      for (std::size_t i = 0; i < stages_.size(); ++i) {
        if (flat >= first_[i]) ((*stages_[i]).*add)(tile.index, tile.made[i].get(), writer_);
      }
    };
    hand_on(&Stage::add_before);
    if (flat >= first_new_) writer_.add_tile(tile.encoded);
    hand_on(&Stage::add_after);
    conversion_.job.report({"tiles", "tiles", flat + 1 - conversion_.first_tile,
                            conversion_.end_tile - conversion_.first_tile, writer_.bytes_written()});
  }

  const Conversion& conversion_;
  ArchiveWriter& writer_;
  const Stages& stages_;
  CodeSource source_;
  const CountedVertices counted_;
  const VoidTile nothing_;
  const std::int64_t first_new_;     ///< flat index of the first tile that the writer has not
  std::vector<std::int64_t> first_;  ///< and of each stage
};

/// Rows of tiles on either side of a shard, for its coarse planes and its residuals: what is needed as a rule.
std::int64_t rows_around(const ConvertOptions& options, const ShardWork& shard) {
  return (shard.has_plane_rows ? 1 : 0) + (options.lossless ? 2 : 0);
}

/// What is beside a shard's own rows.
TilesAround make_around(const Conversion& conversion, const ShardWork& shard, const ResidualStage* residuals) {
  RowRange north{shard.record.first_row, shard.record.first_row - 1};
  RowRange south{shard.record.end_row, shard.record.end_row - 1};
  const auto reach_over = [&](const RowRange& needed) {
    if (needed.first > needed.last) return;
    north.first = std::max<std::int64_t>(std::min(north.first, needed.first), 0);
    south.last = std::min(std::max(south.last, needed.last), conversion.plan.grid.tile_rows() - 1);
  };
  if (shard.has_plane_rows) reach_over({shard.record.first_row - 1, shard.record.end_row});
  if (residuals != nullptr) reach_over(residuals->tile_rows_needed());
  return {conversion, north, south};
}

void check(const ConvertOptions& options) {
  const auto refuse = [](const std::string& why) { throw Error(ErrorCode::kInvalidArgument, why); };
  require_known("`code_type`", options.code_type, CodeType::kF32);
  require_known("filter", options.filter.value_or(kDefaultFilter), Filter::kBspline3);
  (void)with_taps(options.acquisition);
  require_known("effort", options.effort, Effort::kBest);
  if (options.z_range) {
    const auto [low, high] = *options.z_range;
    if (!(low < high && std::isfinite(high - low)))
      refuse(fmt::format("`z_range` is {}:{}, must be two numbers, the smaller first", low, high));
  }
  if (options.step && !(std::isfinite(*options.step) && *options.step >= 0.0))
    refuse(fmt::format("step is {}, must be positive, or 0 for the finest", *options.step));
  const auto check_positive = [&](const char* what, const std::optional<double>& value) {
    if (value && !(std::isfinite(*value) && *value > 0.0))
      refuse(fmt::format("{} is {}, must be above 0", what, *value));
  };
  check_positive("`max_rounding`", options.max_rounding);
  check_positive("`max_error`", options.max_error);
  if (options.step && options.max_rounding && *options.step == 0.0)
    refuse("`max_rounding` is given beside the finest step; give a step, or one of the two");
  if (!options.texture) return;
  if (options.texture->photo == nullptr) refuse("`texture` has no photo");
  require_known("`texture`: its format", options.texture->format.value_or(TextureFormat::kPng), TextureFormat::kJpeg);
}

void refuse_warnings(const ConvertSummary& summary, const ConvertOptions& options) {
  if (options.strict && !summary.warnings.empty()) throw error_from(summary.warnings);
}

/// What is odd before a sample is read.
void warn_of_plan(const SourceInfo& info, const Plan& plan, const PlanRequest& request, const TextureStage* textures,
                  std::vector<Warning>& warnings) {
  warnings = info.warnings;
  // A reader of ours has said so, perhaps of more rows.
  const auto is_of_latitudes = [](const Warning& warning) {
    return warning.find("no ground beyond 90") != std::string::npos;
  };
  if (std::string text = latitude_warning(info); !text.empty() && std::ranges::none_of(warnings, is_of_latitudes))
    warnings.emplace_back(info.path + ": " + std::move(text));
  if (std::string text = scale_warning(info, plan.frame, request.ground.projection); !text.empty()) {
    warnings.emplace_back(std::move(text));
  }
  for (Warning& warning : plan_warnings(info, plan, request)) warnings.push_back(std::move(warning));
  if (textures != nullptr) warnings.insert(warnings.end(), textures->warnings().begin(), textures->warnings().end());
}

/// Holds what all tiles together came to against the options.
void check_statistics(const Conversion& conversion, const TileStatistics& all, bool may_be_void,
                      std::vector<Warning>& warnings) {
  const std::string& path = conversion.source.info().path;
  const ConvertOptions& options = conversion.options;
  if (all.voids == all.vertices && !may_be_void) {
    throw Error(ErrorCode::kNoElevation,
                fmt::format("{}: every one of the {} lattice vertices is void, nothing to write", path, all.vertices));
  }
  const double worst = all.worst_rounding + conversion.height_error;
  if (options.max_rounding && worst > *options.max_rounding * (1.0 + 1e-6)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: elevations are rounded by up to {:.3g} as {}, more than `max_rounding` {}; use that "
                            "much, or another `code_type`",
                            path, worst, to_string(options.code_type), *options.max_rounding));
  }
  if (all.clamped > 0) {
    warnings.push_back(
        loss(fmt::format("{}: {} of {} lattice vertices lay outside {} to {} and were moved to its ends", path,
                         all.clamped, all.vertices, conversion.limits.lowest, conversion.limits.highest)));
  }
}

/// The accuracy of the archive as it will be, by the surface that a reader of it finds.
AccuracyReport measure(const std::string& archive, const Conversion& conversion) {
  ArchiveReader reader(archive);
  reader.set_source_map(conversion.options.plan.ground.source_map);
  reader.set_world_map(conversion.options.plan.ground.projection.system_map.map);
  return compare_with_source(reader, conversion.source, conversion.job);
}

AccuracyInfo info_of(const AccuracyReport& report, const ConvertOptions& options, double rounding) {
  return {report.samples_compared, report.samples_lost, report.rms, report.max, options.max_error, rounding};
}

/// Throws for what neither plan nor memory can make possible.
void check_source(HeightSource& source, const Plan& plan, const ConvertOptions& options) {
  const SourceInfo& info = source.info();
  if (options.shadow_seeds) check_seed_request(*options.shadow_seeds, info, plan);
  if (!options.lossless || info.fill_distance == 0 || &source.as_stored() != &source) return;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("{}: `lossless` keeps the samples as they were before `fill`, which are out of reach; leave "
                          "one of the two out",
                          info.path));
}

WriterOptions writer_options(const Conversion& conversion, const ShardWork* shard) {
  const ConvertOptions& options = conversion.options;
  WriterOptions how{options.overwrite, options.resume,
                    job_fingerprint(conversion.source.info(), conversion.plan, options),
                    options.planes ? planes_for(conversion.plan.grid) : PlaneInfo(), conversion.first_tile};
  if (shard != nullptr)
    how.job_fingerprint += fmt::format(" | shard {} of {}", shard->record.number, shard->record.count);
  return how;
}

/// In the order in which they take a tile. `around`  is made here for a shard, and outlives them.
Stages make_stages(const Conversion& conversion, const ShardWork* shard, std::unique_ptr<TextureStage> textures,
                   std::optional<TilesAround>& around, ArchiveWriter& writer) {
  const ConvertOptions& options = conversion.options;
  const Plan& plan = conversion.plan;
  const MemoryPlan& memory = conversion.memory;
  const auto scratch = [&](bool is_used) {
    return is_used ? ScratchFolder(conversion.job.scratch_folder) : std::nullopt;
  };
  const RowRange rows = shard != nullptr ? RowRange{shard->record.first_row, shard->record.end_row - 1}
                                         : RowRange{0, plan.grid.tile_rows() - 1};
  std::unique_ptr<ResidualStage> residuals;
  if (options.lossless) residuals = std::make_unique<ResidualStage>(conversion, rows);
  if (shard != nullptr) around.emplace(make_around(conversion, *shard, residuals.get()));
  if (residuals && around) residuals->set_around(*around);
  Stages stages;
  if (textures) stages.push_back(std::move(textures));
  if (const PlaneInfo coarse = options.planes ? planes_for(plan.grid) : PlaneInfo(); coarse.count > 0) {
    stages.push_back(std::make_unique<PlaneStage>(Planes(plan.grid, coarse.stride, coarse.count, plan.frame.wraps_x),
                                                  conversion.quantisation, options.effort, writer, rows,
                                                  around ? &*around : nullptr, scratch(memory.planes_in_scratch)));
  }
  if (options.shadow_seeds) {
    // Lengths of both kinds are compared as metres where both are known to be.
    const SourceInfo& info = conversion.source.info();
    const bool known = plan.frame.in_metres && !info.vertical_unit.empty();
    stages.push_back(std::make_unique<SeedStage>(
        plan.grid, plan.frame.bounds(), conversion.quantisation, *options.shadow_seeds,
        known ? 1.0 / info.metres_per_vertical_unit : 1.0, scratch(memory.seeds_in_scratch)));
  }
  if (residuals) stages.push_back(std::move(residuals));
  return stages;
}

/// Metadata and summary of a conversion whose members are all written.
void describe(const Conversion& conversion, const ShardWork* shard, const Stages& stages, const ArchiveWriter& writer,
              ConvertSummary& summary) {
  const TileGrid& grid = conversion.plan.grid;
  const SourceInfo& info = conversion.source.info();
  Metadata& metadata = summary.metadata;
  metadata = describe_job(info, conversion.plan, conversion.options, conversion.quantisation);
  metadata.statistics = total_statistics(writer.statistics());
  if (conversion.most_off() > 0.0) metadata.rounding = conversion.most_off();
  for (const auto& stage : stages) stage->describe(writer, metadata, summary);
  if (shard != nullptr) {
    ShardRecord record = shard->record;
    std::vector<double> sums = writer.row_sums();
    sums.resize(static_cast<std::size_t>(record.end_row));
    record.row_sums.assign(sums.begin() + static_cast<std::ptrdiff_t>(record.first_row), sums.end());
    metadata.extensions.emplace_back(kShardName, format_shard_record(record));
  }
  ISOHF_ASSERT(writer.next_tile() == grid.tile_count());
  metadata.tiles_stored = writer.tiles_stored();
  summary.tiles_expected = summary.tiles_written = conversion.end_tile - conversion.first_tile;
  summary.tiles_void = summary.tiles_written - writer.tiles_stored();
  summary.tile_bytes = writer.tile_bytes();
  summary.plane_bytes = writer.members_in("planes/").bytes;
  summary.source_samples = static_cast<std::uint64_t>(info.width) * static_cast<std::uint64_t>(info.height);
  summary.lattice_samples = static_cast<std::uint64_t>(conversion.plan.lattice_samples);
  summary.step = metadata.quantisation.type == CodeType::kF32 ? 0.0 : metadata.quantisation.scale;
  summary.worst_rounding = metadata.statistics.worst_rounding;
}

/// Measures an archive whose error has a bound: whether it stays within it, and then says so in the metadata.
bool is_within_bound(const Conversion& conversion, ArchiveWriter& writer, ConversionResult& result) {
  const ConvertOptions& options = conversion.options;
  if (!options.max_error) return true;
  Metadata& metadata = result.summary.metadata;
  writer.complete(metadata);
  result.measured = measure(writer.part(), conversion);
  const AccuracyInfo found =
      info_of(*result.measured, options,
              options.code_type == CodeType::kF32 ? metadata.statistics.worst_rounding
                                                  : metadata.rounding.value_or(0.5 * metadata.quantisation.scale));
  if (found.max > *options.max_error) return false;
  metadata.extensions.emplace_back(kAccuracyName, format_accuracy_info(found));
  return true;
}

}  // namespace

Plan plan_conversion(const SourceInfo& info, const ConvertOptions& options) {
  check(options);
  return make_plan(info, options.plan);
}

ShardRange find_shard_range(HeightSource& source, const ConvertOptions& options, const Job& job) {
  const Plan plan = plan_conversion(source.info(), options);
  const MemoryPlan memory = plan_memory(source, plan, options, job);
  check_memory(source, memory, job);
  const Kernel kernel = Kernel::make(options.filter.value_or(kDefaultFilter));
  Conversion conversion{source, options, plan, memory, kernel, Prefilter::make(kernel.filter(), options.acquisition),
                        job};
  ConvertSummary summary(plan.grid);
  Arena(job).execute([&] { choose_codes(conversion, summary); });
  if (options.z_range) return {options.z_range->first, options.z_range->second, conversion.quantisation.scale};
  const ElevationRange& range = conversion.range;
  const double step = conversion.quantisation.scale;
  const bool takes_all_codes = (range.max - range.min) / step + 2.0 > conversion.quantisation.max_code();
  // Ends that are short to write: whole steps, or decimal fractions of a step if that takes all codes.
  const double unit = takes_all_codes ? std::pow(10.0, std::floor(std::log10(step))) : step;
  const auto end = [&](double units) {
    const std::string text = fmt::format("{:.12g}", units * unit);
    double value = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
  };
  const double first = std::floor(range.min / unit + 1e-9);
  return {end(first), end(std::max(std::ceil(range.max / unit - 1e-9), first + 1.0)), step};
}

ConversionResult run_conversion(HeightSource& source, const Plan& plan, const std::string& output,
                                const ConvertOptions& options, const Job& job, bool is_retry, const ShardWork* shard) {
  const auto start = std::chrono::steady_clock::now();
  check_source(source, plan, options);
  std::unique_ptr<TextureStage> textures;
  if (options.texture) {
    textures = std::make_unique<TextureStage>(
        TextureStage::make(plan, source.info(), *options.texture, threads_of(job), textured_tiles_in_flight(job)));
  }
  const std::int64_t beside = shard != nullptr ? 2 * rows_around(options, *shard) : 0;
  const MemoryPlan memory =
      plan_memory(source, plan, options, job,
                  (textures ? textures->memory_bytes() : 0) + TilesAround::memory_bytes(plan.grid, beside));
  check_memory(source, memory, job);
  ConversionResult result{ConvertSummary(plan.grid), {}};
  ConvertSummary& summary = result.summary;
  warn_of_plan(source.info(), plan, options.plan, textures.get(), summary.warnings);
  refuse_warnings(summary, options);
  const Kernel kernel = Kernel::make(options.filter.value_or(kDefaultFilter));
  Conversion conversion{source, options, plan, memory, kernel, Prefilter::make(kernel.filter(), options.acquisition),
                        job};
  if (shard != nullptr) {
    conversion.first_tile = shard->record.first_row * plan.grid.tile_columns();
    conversion.end_tile = shard->record.end_row * plan.grid.tile_columns();
  }
  ArchiveWriter writer(output, plan.grid, writer_options(conversion, shard));
  try {
    std::optional<TilesAround> around;
    Stages stages;
    Arena(job).execute([&] {
      choose_codes(conversion, summary);
      refuse_warnings(summary, options);
      stages = make_stages(conversion, shard, std::move(textures), around, writer);
      TilePass(conversion, writer, stages).run();
      for (const auto& stage : stages) stage->finish(writer, job);
    });
    check_statistics(conversion, writer.statistics(), shard != nullptr, summary.warnings);
    refuse_warnings(summary, options);
    describe(conversion, shard, stages, writer, summary);
    result.is_finished = is_within_bound(conversion, writer, result);
    summary.archive_bytes = result.is_finished ? writer.finish(summary.metadata) : writer.bytes_written();
  } catch (const Error& error) {
    if (is_retry) throw;
    // What is done stays for a resume when the user or the system ended it.
    if (error.code() == ErrorCode::kCancelled) writer.keep_part();
    if (error.code() != ErrorCode::kIo || !writer.keep_part()) throw;
    throw Error(ErrorCode::kIo,
                fmt::format("{}; {}.part keeps what is done, `resume` goes on from there", error.what(), output));
  }
  summary.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return result;
}

}  // namespace isohf
