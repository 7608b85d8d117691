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
#include "isohf/convert/stages/seed_stage.h"
#include "isohf/convert/stages/texture_stage.h"
#include "isohf/error.h"
#include "isohf/projection/crs/crs.h"
#include "isohf/restore/lossless.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"

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
/// Of the source's rows: with more, and where a map bends them, windows are kept instead.
constexpr double kMostRowsBytes = 512.0 * kMiB;
constexpr std::uint64_t kWindowsBytes = 256 * kMiB;
constexpr std::uint64_t kLeastWindowsBytes = 2 * kMiB;
/// Where nobody limits it.
constexpr std::size_t kUnlimitedRation = 1;
constexpr int kTexturedTilesPerThread = 2;

/// What a ResidualStage holds from its beginning on.
std::uint64_t kept_residual_bytes(const SourceInfo& info, const Plan& plan, bool in_scratch) {
  return plan.frame.warp ? 0 : SplinePredictor::kept_bytes(info.width, in_scratch);
}

/// What its finish() holds at most.
std::uint64_t residual_bytes(const SourceInfo& info, const Plan& plan, int threads, std::size_t members_at_once,
                             bool in_scratch) {
  const TileShape& shape = plan.grid.shape();
  const auto width = static_cast<double>(info.width);
  const auto rows = static_cast<double>(std::min(rows_per_residual_member(info), info.height));
  const auto sample = static_cast<double>(size_bytes(info.sample_type));
  // Raw samples, predictions and what they deflate to; in each thread also voids, streams and payload.
  const double members =
      std::min(static_cast<double>(members_at_once), std::ceil(static_cast<double>(info.height) / rows));
  const double bands = members * rows * width * (2.0 * sample + 8.0);
  const double encoding = std::min<double>(threads, members) * rows * width * (1.0 + 5.0 * sample);
  if (plan.frame.warp) {
    // A position for each sample of a member, tiles that are kept, and one in each thread.
    const double tile_bytes = 8.0 * static_cast<double>(shape.stored_vertex_count());
    const double mesh = 16.0 * static_cast<double>(PlaceMesh::value_count(info.width, info.height));
    return static_cast<std::uint64_t>(bands + encoding + rows * width * 16.0 + mesh + threads * 2.0 * tile_bytes +
                                      static_cast<double>(SamplePredictor::kTileBytes));
  }
  const double lattice_rows = rows * plan.frame.spacing_z / plan.grid.sigma_z();
  return static_cast<std::uint64_t>(
             bands + std::max(encoding, SplinePredictor::lines_bytes(plan.grid, threads, in_scratch)) +
             SplinePredictor::rows_bytes(plan.grid, info.width, lattice_rows, threads, in_scratch)) +
         kept_residual_bytes(info, plan, in_scratch);
}

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
        scratch_folder_(job.scratch_folder),
        threads_(threads_of(job)) {
    const TileGrid& grid = plan.grid;
    // Source rows and columns of a tile with its padding and the taps around it; of one that a map turns either way.
    const int taps = Kernel::make(options.filter.value_or(kDefaultFilter)).taps();
    double rows = grid.shape().rows() * grid.sigma_z() / plan.frame.spacing_z;
    double columns = grid.shape().columns() * 2.0 * grid.sigma_x() / plan.frame.spacing_x;
    if (plan.frame.warp) rows = columns = std::hypot(rows, columns);
    tile_rows_ = std::min(rounded(rows) + taps + 2, info_.height);
    tile_columns_ = std::min(rounded(columns) + taps + 2, info_.width);
    halo_ = prefilter.halo();
    if (chooses_codes(options)) halo_ = std::max<std::int64_t>(halo_, Prefilter::smoothing().halo());
  }

  /// Whether rows of the source are too many to be kept whole.
  [[nodiscard]] bool needs_windows() const {
    return plan_.frame.warp || rows_bytes(with(kRations[kUnlimitedRation], false)) > kMostRowsBytes;
  }

  [[nodiscard]] MemoryPlan with(const Ration& ration, bool in_windows) const {
    MemoryPlan memory;
    // Several reads of even a small raster: what follows begins with the first of them.
    const std::uint64_t part = row_bytes() * static_cast<std::uint64_t>(info_.height) / kLeastReads;
    const std::uint64_t read_bytes = std::min(ration.read_bytes, std::max(part, row_bytes()));
    memory.scan_step = ReadStep::make(info_, read_bytes);
    memory.tiles_in_flight =
        static_cast<std::size_t>(threads_ * (options_.texture ? kTexturedTilesPerThread : ration.tiles_per_thread));
    memory.members_at_once = ration.members_at_once;
    memory.rows = CellStore::of_rows(info_, read_bytes);
    if (in_windows) {
      memory.rows = CellStore::of_windows(info_, kLeastWindowsBytes, scratch_folder_);
      const std::uint64_t least = total(memory);
      const std::uint64_t more = limit_ == 0 ? kWindowsBytes : limit_ - std::min(limit_, least);
      memory.rows = CellStore::of_windows(info_, std::min(kLeastWindowsBytes + more, kWindowsBytes), scratch_folder_);
      const std::int64_t rows = plan_.frame.warp ? info_.height : rows_in_use(memory);
      const std::uint64_t alive = static_cast<std::uint64_t>(rows) * row_bytes();
      if (alive > memory.rows.most_bytes) memory.scratch_bytes = alive;
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

  /// Rows of the source that the tiles in flight read, where its rows are rows of tiles: the last tile of one row may
  /// still be waited for while all tiles in flight behind it have entered.
  [[nodiscard]] std::int64_t rows_in_use(const MemoryPlan& memory) const {
    const std::int64_t tiles = plan_.grid.tile_columns();
    const std::int64_t tile_rows = (static_cast<std::int64_t>(memory.tiles_in_flight) + tiles - 2) / tiles + 1;
    const std::int64_t step = memory.rows.step.rows;
    return std::min(tile_rows * (tile_rows_ + 2 * halo_) + 2 * step, (info_.height + step - 1) / step * step);
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
    const double tiles = waiting * vertices * kWaitingBytesPerVertex + rows_bytes(memory) + window_bytes() + seeds +
                         static_cast<double>(plane_bytes(memory)) + static_cast<double>(texture_bytes_);
    double peak = std::max(scan_pass(memory), tiles);
    if (options_.lossless) {
      peak += static_cast<double>(kept_residual_bytes(info_, plan_, memory.residuals_in_scratch));
      peak = std::max(peak, static_cast<double>(residual_bytes(info_, plan_, threads_, memory.members_at_once,
                                                               memory.residuals_in_scratch)));
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

  /// What is kept of the source.
  [[nodiscard]] double rows_bytes(const MemoryPlan& memory) const {
    const CellStore& rows = memory.rows;
    if (rows.most_bytes == UINT64_MAX)
      return static_cast<double>(rows_in_use(memory)) * static_cast<double>(row_bytes());
    // Tiles in flight hold cells that cannot go; those beside each other the same ones. The next read comes on top.
    const auto in_flight = static_cast<std::int64_t>(memory.tiles_in_flight);
    const std::int64_t columns = std::min(in_flight * tile_columns_ + 2 * rows.cell_columns, info_.width);
    const std::int64_t held = std::min(rows_in_use(memory), in_flight * (tile_rows_ + 2 * halo_ + 2 * rows.step.rows));
    const double pinned = static_cast<double>(columns * held) * static_cast<double>(size_bytes(info_.sample_type));
    const double all = static_cast<double>(info_.height) * static_cast<double>(row_bytes());
    // A read, the cells that it becomes, and the memory of as many that were dropped, on either side of a tile.
    return std::min(std::max(pinned, static_cast<double>(rows.most_bytes)), all) +
           4.0 * static_cast<double>(rows.step.most_bytes(info_));
  }

  /// What tiles are cut from: heights, coefficients and voids, in each thread; one of a joined globe may have whole rows.
  [[nodiscard]] double window_bytes() const {
    const double columns = static_cast<double>(std::min(tile_columns_ + 2 * halo_, info_.width));
    const double samples = static_cast<double>(tile_rows_ + 2 * halo_) *
                           (threads_ * columns +
                            (plan_.frame.wraps_x || plan_.frame.samples_wrap ? static_cast<double>(info_.width) : 0.0));
    const double strips = halo_ == 0 ? 0.0 : threads_ * 64.0 * 12.0 * static_cast<double>(tile_rows_ + 2 * halo_);
    return strips + samples * (halo_ == 0 ? sizeof(float) : 2.0 * sizeof(float) + 2.0);
  }

  const HeightSource& source_;
  const SourceInfo& info_;
  const Plan& plan_;
  const ConvertOptions& options_;
  std::uint64_t texture_bytes_;
  std::uint64_t limit_;
  std::string scratch_folder_;
  int threads_;
  std::int64_t halo_ = 0;          ///< samples around a tile's window that its coefficients depend on
  std::int64_t tile_rows_ = 0;     ///< of the source, that a tile reads
  std::int64_t tile_columns_ = 0;  ///< of the source, that a tile reads
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
  const bool needs_windows = estimate.needs_windows();
  const auto choose = [&]() -> MemoryPlan {
    if (job.memory_bytes == 0) {
      const MemoryPlan fastest = estimate.with(kRations[kUnlimitedRation], needs_windows);
      if (job.bound_bytes() == 0 || fastest.bytes <= job.bound_bytes()) return fastest;
    }
    for (const bool in_windows : {needs_windows, true}) {
      for (const Ration& ration : kRations) {
        const MemoryPlan memory = estimate.with(ration, in_windows);
        if (memory.bytes <= job.bound_bytes()) return memory;
      }
    }
    const MemoryPlan in_rows = estimate.with(kRations.back(), needs_windows);
    const MemoryPlan in_windows = estimate.with(kRations.back(), true);
    return in_windows.bytes < in_rows.bytes ? in_windows : in_rows;
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

void check_memory(const HeightSource& source, const MemoryPlan& memory, const Job& job) {
  if (job.bound_bytes() == 0 || memory.bytes <= job.bound_bytes()) return;
  try {
    require_memory(job, static_cast<double>(memory.bytes), static_cast<double>(memory.least_bytes), "this conversion",
                   "smaller tiles (`shape`)");
  } catch (const Error& error) {
    throw error.within(source.info().path);
  }
}

}  // namespace isohf
