#include "isohf/convert/memory_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "isohf/archive/planes/archive_planes.h"
#include "isohf/archive/planes/plane_builder.h"
#include "isohf/base/arena.h"
#include "isohf/base/memory/memory_budget.h"
#include "isohf/base/text/number_text.h"
#include "isohf/convert/stages/residual_stage.h"
#include "isohf/convert/stages/seed_stage.h"
#include "isohf/convert/stages/texture_stage.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/source/band_reader.h"

namespace isohf {
namespace {

/// In each thread, of each vertex of a tile: its height and code, and what the encoder works with.
constexpr double kBytesPerVertex = 24.0;
/// Of each tile of an archive that is written: index, journal and directory.
constexpr double kBytesPerTile = 200.0;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;

/// Of a tile that waits to be written.
constexpr double kWaitingBytesPerVertex = 1.3;

/// What is set when memory is short: reads and tiles in flight, in the order of preference.
struct Ration {
  std::uint64_t read_bytes;
  int tiles_per_thread;
  std::size_t members_at_once;
};
constexpr std::array<Ration, 7> kRations = {{{8 * kMiB, 16, 8},
                                             {4 * kMiB, 16, 8},
                                             {4 * kMiB, 8, 4},
                                             {2 * kMiB, 8, 2},
                                             {kMiB, 4, 2},
                                             {kMiB / 2, 2, 1},
                                             {kMiB / 4, 2, 1}}};
constexpr std::uint64_t kLeastReads = 8;
/// Where nobody limits it.
constexpr std::size_t kUnlimitedRation = 1;
constexpr int kTexturedTilesPerThread = 2;

class Estimate {
 public:
  /// limit: 0 where there is none.
  Estimate(const HeightSource& source, const Plan& plan, const ConvertOptions& options, const Job& job,
           const Prefilter& prefilter, std::uint64_t texture_bytes, std::uint64_t limit)
      : source_(source),
        info_(source.info()),
        plan_(plan),
        options_(options),
        texture_bytes_(texture_bytes),
        limit_(limit),
        prefilter_(prefilter),
        threads_(threads_of(job)) {
    const TileGrid& grid = plan.grid;
    // Source rows and columns of a tile with its padding and the taps around it.
    const int taps = Kernel::make(options.filter.value_or(kDefaultFilter)).taps();
    tile_rows_ = std::min(rounded(plan.band_rows) + taps + 2, info_.height);
    tile_columns_ =
        std::min(rounded(grid.shape().columns() * 2.0 * grid.sigma_x() / plan.frame.spacing_x) + taps + 2, info_.width);
    reads_whole_rows_ = plan.frame.warp || plan.frame.wraps_x;
    has_bands_ = !prefilter.is_identity() || plan.frame.warp;
    if (chooses_codes(options)) smoothing_ = Prefilter::smoothing();
  }

  [[nodiscard]] MemoryPlan with(const Ration& ration, bool in_scratch) const {
    const TileGrid& grid = plan_.grid;
    MemoryPlan memory;
    // Several reads of even a small raster: what follows begins with the first of them.
    const std::uint64_t part = row_bytes() * static_cast<std::uint64_t>(info_.height) / kLeastReads;
    memory.scan_step = memory.read_step =
        ReadStep::make(info_, std::min(ration.read_bytes, std::max(part, row_bytes())));
    memory.tiles_in_flight =
        static_cast<std::size_t>(threads_ * (options_.texture ? kTexturedTilesPerThread : ration.tiles_per_thread));
    memory.members_at_once = ration.members_at_once;
    memory.tile_columns_at_once = grid.tile_columns();
    if (in_scratch) {
      std::int64_t in_use = prefilter_.is_identity() ? parts_in_flight(memory, grid.tile_columns()) * tile_rows_
                                                     : tile_rows_ + 2 * prefilter_.halo();
      if (smoothing_) in_use = std::max(in_use, tile_rows_ + 2 * smoothing_->halo());
      memory.scratch_rows = std::min(SourceRows::kept_rows_for(memory.read_step, in_use), info_.height);
      memory.scratch_bytes = static_cast<std::uint64_t>(memory.scratch_rows) * row_bytes() * (smoothing_ ? 2 : 1);
      if ((has_bands_ || smoothing_) && !reads_whole_rows_) choose_columns(memory);
    }
    memory.bytes = total(memory);
    // Where it helps: buffers for a file take as much as a few tiles.
    const auto try_scratch = [&](bool MemoryPlan::*in_scratch_too) {
      MemoryPlan other = memory;
      other.*in_scratch_too = true;
      other.bytes = total(other);
      if (limit_ != 0 && memory.bytes > limit_ && other.bytes < memory.bytes) memory = other;
    };
    if (options_.shadow_seeds) try_scratch(&MemoryPlan::seeds_in_scratch);
    if (options_.planes) try_scratch(&MemoryPlan::planes_in_scratch);
    if (options_.lossless) try_scratch(&MemoryPlan::residuals_in_scratch);
    return memory;
  }

 private:
  static std::int64_t rounded(double samples) { return static_cast<std::int64_t>(std::ceil(samples)); }
  [[nodiscard]] std::uint64_t row_bytes() const {
    return static_cast<std::uint64_t>(info_.width) * size_bytes(info_.sample_type);
  }

  /// Groups of `tiles` tiles that are in hand at once: the last tile of one may still be waited for while all tiles in
  /// flight behind it have entered.
  [[nodiscard]] static std::int64_t parts_in_flight(const MemoryPlan& memory, std::int64_t tiles) {
    return (static_cast<std::int64_t>(memory.tiles_in_flight) + tiles - 2) / tiles + 1;
  }

  /// As many tiles as may be prefiltered together within the limit.
  void choose_columns(MemoryPlan& memory) const {
    std::int64_t fits = 1;
    for (std::int64_t beyond = plan_.grid.tile_columns() + 1; beyond - fits > 1;) {
      memory.tile_columns_at_once = (fits + beyond) / 2;
      (total(memory) <= limit_ ? fits : beyond) = memory.tile_columns_at_once;
    }
    memory.tile_columns_at_once = fits;
  }

  [[nodiscard]] std::uint64_t map_bytes() const {
    // PROJ has read the system that the source names, or the one that it is projected to.
    const ReferenceSystem& system = info_.georeference.system;
    const bool is_read = system.epsg || !system.wkt.empty() || options_.plan.ground.projection.system_map.map;
    return is_read ? Crs::kProjBytes : 0;
  }

  [[nodiscard]] std::uint64_t total(const MemoryPlan& memory) const {
    const auto vertices = static_cast<double>(plan_.grid.shape().stored_vertex_count());
    const double program = kProgramBytes + threads_ * kThreadBytes + threads_ * vertices * kBytesPerVertex +
                           kBytesPerTile * static_cast<double>(plan_.grid.tile_count()) +
                           static_cast<double>(source_.buffer_bytes()) + static_cast<double>(map_bytes());
    const double seeds =
        options_.shadow_seeds ? static_cast<double>(SeedRow::memory_bytes(plan_.grid, memory.seeds_in_scratch)) : 0.0;
    const auto waiting =
        std::min(static_cast<double>(memory.tiles_in_flight), static_cast<double>(plan_.grid.tile_count()));
    const double tiles = waiting * vertices * kWaitingBytesPerVertex + source_pass(memory, prefilter_, has_bands_) +
                         (smoothing_ ? source_pass(memory, *smoothing_, true) : 0.0) + seeds +
                         static_cast<double>(plane_bytes(memory)) + static_cast<double>(texture_bytes_);
    double peak = std::max(scan_pass(memory), tiles);
    if (options_.lossless) {
      peak += static_cast<double>(residual_stage_kept_bytes(info_, plan_, memory.residuals_in_scratch));
      peak = std::max(peak, static_cast<double>(residual_stage_memory_bytes(
                                info_, plan_, threads_, memory.members_at_once, memory.residuals_in_scratch)));
    }
    return static_cast<std::uint64_t>(program + peak);
  }

  [[nodiscard]] std::uint64_t plane_bytes(const MemoryPlan& memory) const {
    const PlaneInfo info = options_.planes ? planes_for(plan_.grid) : PlaneInfo();
    return plane_builder_memory_bytes(Planes(plan_.grid, info.stride, info.count, false), options_.code_type,
                                      memory.planes_in_scratch);
  }

  [[nodiscard]] double scan_pass(const MemoryPlan& memory) const {
    if (options_.z_range) return 0.0;
    const double edge_rows = 2.0 * (kContinuedSteps * plan_.grid.sigma_z() / plan_.frame.spacing_z + 4.0);
    return 2.0 * static_cast<double>(memory.scan_step.most_bytes(info_)) +
           edge_rows * sizeof(float) * static_cast<double>(info_.width);
  }

  /// The source's rows, and what tiles are cut from.
  [[nodiscard]] double source_pass(const MemoryPlan& memory, const Prefilter& prefilter, bool has_bands) const {
    double bytes = 0.0;
    const std::int64_t step = memory.read_step.rows;
    // Slabs that hold the rows of two rows of tiles, wherever they begin; the prefilter copies what it needs at once.
    const std::int64_t in_use = prefilter.is_identity()
                                    ? parts_in_flight(memory, plan_.grid.tile_columns()) * tile_rows_
                                    : std::min(tile_rows_, step);
    const std::int64_t slabs = std::min((in_use + step - 2) / step + 1, (info_.height + step - 1) / step);
    const bool in_parts = memory.read_step.columns < info_.width;
    if (memory.scratch_rows == 0) {
      bytes += static_cast<double>(slabs * step) * static_cast<double>(row_bytes());
      if (in_parts) bytes += static_cast<double>(memory.read_step.most_bytes(info_));
    } else {
      bytes += static_cast<double>(memory.read_step.most_bytes(info_));
    }
    if (!has_bands) {
      return bytes + threads_ * static_cast<double>(tile_rows_) * static_cast<double>(tile_columns_) * sizeof(float);
    }
    const double columns = std::min(static_cast<double>(info_.width), static_cast<double>(memory.tile_columns_at_once) *
                                                                          static_cast<double>(tile_columns_));
    // Strips of columns that the threads filter, doubles.
    const double strips = threads_ * 64.0 * 12.0 * static_cast<double>(tile_rows_ + 2 * prefilter.halo());
    // Pieces of changing sizes leave gaps in the heap, in that of every thread (measured).
    const double gaps = memory.scratch_rows > 0 ? 1.0 + 0.2 * threads_ : 1.0;
    const std::uint64_t bands =
        BandReader::memory_bytes(prefilter, parts_in_flight(memory, memory.tile_columns_at_once), tile_rows_,
                                 static_cast<std::int64_t>(columns), info_);
    return bytes + strips + gaps * static_cast<double>(bands);
  }

  const HeightSource& source_;
  const SourceInfo& info_;
  const Plan& plan_;
  const ConvertOptions& options_;
  std::uint64_t texture_bytes_;
  std::uint64_t limit_;
  const Prefilter& prefilter_;
  int threads_;
  std::optional<Prefilter> smoothing_;  ///< where codes may be chosen from several
  bool reads_whole_rows_ = false;       ///< tiles of a row are cut from whole rows of the source
  bool has_bands_ = false;              ///< of heights or coefficients, instead of tiles' own pieces
  std::int64_t tile_rows_ = 0;          ///< of the source, that a row of tiles reads
  std::int64_t tile_columns_ = 0;       ///< of the source, that a tile reads
};

}  // namespace

int textured_tiles_in_flight(const Job& job) {
  return threads_of(job) * kTexturedTilesPerThread;
}

MemoryPlan plan_memory(const HeightSource& source, const Plan& plan, const ConvertOptions& options, const Job& job,
                       std::uint64_t texture_bytes) {
  const Prefilter prefilter = Prefilter::make(options.filter.value_or(kDefaultFilter), options.acquisition);
  const Estimate estimate(source, plan, options, job, prefilter, texture_bytes, job.bound_bytes());
  const Estimate least(source, plan, options, job, prefilter, texture_bytes, 1);
  const std::uint64_t least_bytes =
      std::min(least.with(kRations.back(), false).bytes, least.with(kRations.back(), true).bytes);
  const auto choose = [&]() -> MemoryPlan {
    if (job.memory_bytes == 0) {
      const MemoryPlan fastest = estimate.with(kRations[kUnlimitedRation], false);
      if (job.bound_bytes() == 0 || fastest.bytes <= job.bound_bytes()) return fastest;
    }
    for (const bool in_scratch : {false, true}) {
      for (const Ration& ration : kRations) {
        const MemoryPlan memory = estimate.with(ration, in_scratch);
        if (memory.bytes <= job.bound_bytes()) return memory;
      }
    }
    const MemoryPlan in_memory = estimate.with(kRations.back(), false);
    const MemoryPlan in_scratch = estimate.with(kRations.back(), true);
    return in_scratch.bytes < in_memory.bytes ? in_scratch : in_memory;
  };
  MemoryPlan memory = choose();
  memory.least_bytes = least_bytes;
  return memory;
}

MemoryPlan plan_memory(const HeightSource& source, const Plan& plan, const ConvertOptions& options, const Job& job) {
  std::uint64_t texture_bytes = 0;
  if (options.texture) {
    texture_bytes =
        TextureStage::make(plan, source.info(), *options.texture, threads_of(job), textured_tiles_in_flight(job))
            .memory_bytes();
  }
  return plan_memory(source, plan, options, job, texture_bytes);
}

namespace {

/// What takes less memory, if something does: rows of the source that stay rows, or a part of it.
std::string remedy_for(const HeightSource& source, const Plan& plan, const ConvertOptions& options, const Job& job) {
  if (!plan.frame.warp) return "smaller tiles (`shape`)";
  ConvertOptions other = options;
  ProjectionRequest& kept = other.plan.ground.projection;
  const bool in_degrees = source.info().georeference.unit == HorizontalUnit::kDegree;
  kept = {};
  kept.is_auto = false;
  kept.kind = in_degrees ? ProjectionKind::kEquirectangular : ProjectionKind::kNone;
  const std::string part = options.source_note.mosaic ? "one conversion for each input" : "a part of it (`bbox`)";
  try {
    const MemoryPlan less = plan_memory(source, make_plan(source.info(), other.plan), other, job);
    if (less.bytes > job.bound_bytes()) return part;
    return fmt::format("`projection` {}, which takes {}, or {}", kept.name(), in_bytes(static_cast<double>(less.bytes)),
                       part);
  } catch (const Error&) {  // which that projection is not for
    return part;
  }
}

}  // namespace

void check_memory(const HeightSource& source, const Plan& plan, const ConvertOptions& options, const MemoryPlan& memory,
                  const Job& job) {
  if (job.bound_bytes() == 0 || memory.bytes <= job.bound_bytes()) return;
  try {
    require_memory(job, static_cast<double>(memory.bytes), static_cast<double>(memory.least_bytes), "this conversion",
                   remedy_for(source, plan, options, job));
  } catch (const Error& error) {
    throw error.within(source.info().path);
  }
}

}  // namespace isohf
