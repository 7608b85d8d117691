#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/archive/writer.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/job.h"
#include "isohf/raster.h"
#include "isohf/restore/lossless.h"

namespace isohf {

/// What write_residuals() holds at most, beyond what convert() needs before it.
[[nodiscard]] std::uint64_t residual_stage_memory_bytes(const SourceInfo& info, const Plan& plan, int threads,
                                                        std::size_t members_at_once, bool in_scratch);
/// What a ResidualStage holds from its beginning on.
[[nodiscard]] std::uint64_t residual_stage_kept_bytes(const SourceInfo& info, const Plan& plan, bool in_scratch);

/// The residual members: every source sample is predicted from the tiles, and the difference kept. Works on the caller's
/// oneTBB arena.
class ResidualStage {
 public:
  /// largest   no elevation is meant to lie further from 0 (FixedHeights::bits_for)
  /// tile_rows whose members are made; all but one row are a shard's
  /// scratch   keeps what samples are predicted from where memory has no room for it
  ResidualStage(HeightSource& source, const SourceFrame& frame, const TileGrid& grid, const Quantisation& quantisation,
                double largest, const RowRange& tile_rows, const ScratchFolder& scratch);

  /// The rows of tiles that the predictions read.
  [[nodiscard]] RowRange tile_rows_needed() const;

  /// Writes the members by tiles that read_tile gives. Reads the source from North to South; memory is bounded by two
  /// rows of tiles and a few bands of source rows. The bytes depend neither on the arena nor on `members_at_once`. Stage
  /// "residuals".
  ///   sha256  of all samples, where it is known; else they are all read here
  [[nodiscard]] LosslessRecord write(const ReadTile& read_tile, std::size_t members_at_once,
                                     const std::optional<std::string>& sha256, ArchiveWriter& writer, const Job& job);

 private:
  HeightSource& source_;
  LosslessRecord record_;
  std::vector<std::byte> nodes_;
  RowRange rows_;  ///< of the source
  ReadTile read_tile_;
  std::optional<SamplePredictor> surface_;
};

/// SHA-256 of all samples, as LosslessRecord states it. Stage "hash".
[[nodiscard]] std::string hash_of_samples(HeightSource& source, const Job& job);

}  // namespace isohf
