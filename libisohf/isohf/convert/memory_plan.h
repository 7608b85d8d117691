#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/raster.h"
#include "isohf/sampling/source/height_rows.h"

namespace isohf {

/// Whether a step and a bound on the rounding leave codes to choose from (docs/decisions/0067).
[[nodiscard]] inline bool chooses_codes(const ConvertOptions& options) {
  return options.step && options.max_rounding && options.code_type != CodeType::kF32;
}

/// Samples of one residual member: enough for its tables, few enough for many to be made side by side.
inline constexpr std::int64_t kSamplesPerResidualMember = std::int64_t{1} << 19U;
[[nodiscard]] inline std::int64_t rows_per_residual_member(const SourceInfo& info) {
  return std::clamp<std::int64_t>(kSamplesPerResidualMember / info.width, 8, info.height + 8);
}

/// How a conversion uses memory. None of it changes a byte of the archive.
struct MemoryPlan {
  std::uint64_t bytes = 0;            ///< resident set at its peak, the program itself included; within a tenth
  std::uint64_t least_bytes = 0;      ///< what the most frugal way takes
  ReadStep scan_step;                 ///< of the pass that finds the range, two reads at a time
  CellStore rows;                     ///< of the pass that makes the tiles
  std::uint64_t scratch_bytes = 0;    ///< of a file for rows that memory has no room for, at most
  std::size_t tiles_in_flight = 1;    ///< read, made, or waiting to be written
  std::size_t members_at_once = 1;    ///< of residuals
  bool seeds_in_scratch = false;      ///< what a row of tiles brings along for them
  bool planes_in_scratch = false;     ///< rows of tiles that they are made of
  bool residuals_in_scratch = false;  ///< rows of tiles and lattice rows that they are predicted from
};

/// The one estimate that plans, bounds and convert() go by. Takes the fastest way that stays within the job's bound, or
/// the most frugal one where none does: bytes exceed it then.
/// texture_bytes: what a TextureStage takes, where there is one.
[[nodiscard]] MemoryPlan plan_memory(const HeightSource& source, const Plan& plan, const ConvertOptions& options,
                                     const Job& job, std::uint64_t texture_bytes);

/// The same, with the textures that the options ask for.
[[nodiscard]] MemoryPlan plan_memory(const HeightSource& source, const Plan& plan, const ConvertOptions& options,
                                     const Job& job);

/// Throws Error{kOutOfMemory} if a plan takes more than the job's bound, with the figure.
void check_memory(const HeightSource& source, const MemoryPlan& memory, const Job& job);

/// Tiles in flight where each brings a texture along.
[[nodiscard]] int textured_tiles_in_flight(const Job& job);

}  // namespace isohf
