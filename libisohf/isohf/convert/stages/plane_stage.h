#pragma once

#include <cstdint>
#include <optional>

#include "isohf/archive/planes/plane_builder.h"
#include "isohf/archive/writer.h"
#include "isohf/convert/stages/stage.h"
#include "isohf/convert/stages/tiles_around.h"

namespace isohf {

/// Coarse planes in the pass that writes tiles: a row of a plane follows the last tile that it needs. They depend on
/// the tiles alone; a conversion that is resumed reads back those that the rows in hand need.
class PlaneStage final : public Stage {
 public:
  /// Goes on where the writer stands; it outlives this. `effort` is that of the tiles. On the caller's oneTBB arena.
  ///   rows    of tiles that are made: all but a shard's; tiles of planes above none of them are not made
  ///   around  the rows beside a shard's, so that its planes' tiles are those of the whole
  ///   scratch keeps rows of tiles where memory has no room for them
  PlaneStage(const Planes& planes, const Quantisation& quantisation, Effort effort, ArchiveWriter& writer,
             const RowRange& rows, const TilesAround* around = nullptr, const ScratchFolder& scratch = std::nullopt);

  [[nodiscard]] std::unique_ptr<Made> make(TileIndex tile, const TileCodes& codes,
                                           const EncodedTile& encoded) const override;
  void add_after(TileIndex tile, const Made* made, ArchiveWriter& writer) override;
  void pass_over(TileIndex tile) override;
  void finish(ArchiveWriter& /*writer*/, const Job& /*job*/) override { builder_.reset(); }

  /// Any thread.
  [[nodiscard]] PlaneSample sample(const TileCodes& codes, const EncodedTile& encoded) const {
    return encoded.is_empty ? PlaneSample() : builder_->sample(codes, encoded.code_min, encoded.code_max);
  }

  /// Takes the tile that was added to the writer last. One thread.
  void add(const PlaneSample& sample) { builder_->add(sample); }
  /// Instead of tiles those of plane 1, which are there: PlaneBuilder.
  void add_finished(const PlaneSample& sample) { builder_->add_finished(sample); }
  [[nodiscard]] PlaneSample finished_sample(TileIndex tile, const PlaneBuilder::Read& read) const {
    return builder_->sample_of(1, tile, read);
  }

 private:
  const TilesAround* around_;
  std::optional<PlaneBuilder> builder_;  ///< until all tiles are in
};

}  // namespace isohf
