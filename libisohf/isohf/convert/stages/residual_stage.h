#pragma once

#include <cstdint>

#include "isohf/archive/writer.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/job.h"
#include "isohf/raster.h"
#include "isohf/restore/lossless.h"

namespace isohf {

/// What write_residuals() holds at most, beyond what convert() needs before it.
[[nodiscard]] std::uint64_t residual_stage_memory_bytes(const SourceInfo& info, const Plan& plan, int threads,
                                                        std::size_t members_at_once);

/// Writes the residual members: reads all tiles back from the writer, predicts every source sample from them and keeps
/// the difference. All tiles have been added, no member of that name. Reads the source once more from North to South;
/// memory is bounded by two rows of tiles and a few bands of source rows. Works on the caller's oneTBB arena; the bytes
/// depend neither on it nor on `members_at_once`. Stage "residuals".
[[nodiscard]] LosslessRecord write_residuals(HeightSource& source, const SourceFrame& frame, const TileGrid& grid,
                                             const Quantisation& quantisation, std::size_t members_at_once,
                                             ArchiveWriter& writer, const Job& job);

}  // namespace isohf
