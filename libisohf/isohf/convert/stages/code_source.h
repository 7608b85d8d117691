#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "isohf/archive/tile/quantise.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/stages/tile_source.h"

namespace isohf {

/// The codes of tiles in a pass over all of them, in flat order. Where a step and a bound on the rounding leave codes to
/// choose from, that which is nearest to a smoothed source (docs/decisions/0067), which is read a second time for it.
class CodeSource {
 public:
  /// The codes' scale and offset are chosen. The conversion outlives it.
  explicit CodeSource(const Conversion& conversion);

  struct Part {
    std::shared_ptr<const TileSource::Part> exact;
    std::shared_ptr<const TileSource::Part> smooth;

    [[nodiscard]] bool holds(TileIndex tile) const { return exact->holds(tile) && (!smooth || smooth->holds(tile)); }
  };
  /// As TileSource::read.
  [[nodiscard]] std::shared_ptr<const Part> read(TileIndex tile);

  /// heights, codes [C x R] out. nullopt, and codes are left alone, where none of the samples under the tile has an
  /// elevation. Any thread.
  [[nodiscard]] std::optional<QuantiserCounts> cut(TileIndex tile, const Part& part, std::vector<float>& heights,
                                                   TileCodes& codes) const;

 private:
  const Conversion& conversion_;
  TileSource exact_;
  std::optional<TileSource> smooth_;
};

}  // namespace isohf
