#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "isohf/archive/writer.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/stages/stage.h"
#include "isohf/convert/stages/tiles_around.h"
#include "isohf/job.h"
#include "isohf/raster.h"
#include "isohf/restore/lossless.h"

namespace isohf {

/// The residual members: every source sample is predicted from the tiles, and the difference kept.
class ResidualStage final : public Stage {
 public:
  /// tile_rows  whose members are made; all but one row are a shard's. The conversion outlives it.
  ResidualStage(const Conversion& conversion, const RowRange& tile_rows);

  /// The rows of tiles that the predictions read.
  [[nodiscard]] RowRange tile_rows_needed() const;
  /// Where the rows beside a shard's are, once they are made; it outlives this.
  void set_around(const TilesAround& around) { around_ = &around; }

  /// Writes the members. Reads the source from North to South; memory is bounded by two rows of tiles and a few bands of
  /// source rows. The bytes depend neither on the arena nor on MemoryPlan::members_at_once. Stage "residuals".
  void finish(ArchiveWriter& writer, const Job& job) override;
  void describe(const ArchiveWriter& writer, Metadata& metadata, ConvertSummary& summary) const override;

 private:
  const Conversion& conversion_;
  HeightSource& source_;
  LosslessRecord record_;
  std::vector<std::byte> nodes_;
  RowRange rows_;  ///< of the source
  const TilesAround* around_ = nullptr;
  ReadTile read_tile_;
  std::optional<SamplePredictor> surface_;
};

}  // namespace isohf
