#pragma once

#include <cstdint>

#include "isohf/archive/planes/plane_builder.h"
#include "isohf/archive/writer.h"

namespace isohf {

/// Coarse planes in the pass that writes tiles: a row of a plane follows the last tile that it needs. They depend on
/// the tiles alone; a conversion that is resumed reads back those that the rows in hand need.
class PlaneStage {
 public:
  /// Goes on where the writer stands; it outlives this. `level` is that of the tiles. On the caller's oneTBB arena.
  PlaneStage(const Planes& planes, const Quantisation& quantisation, int level, ArchiveWriter& writer);

  /// Any thread.
  [[nodiscard]] PlaneSample sample(const TileCodes& codes, const EncodedTile& encoded) const {
    return encoded.is_empty ? PlaneSample() : builder_.sample(codes, encoded.code_min, encoded.code_max);
  }

  /// Takes the tile that was added to the writer last. One thread.
  void add(const PlaneSample& sample) { builder_.add(sample); }

 private:
  PlaneBuilder builder_;
};

}  // namespace isohf
