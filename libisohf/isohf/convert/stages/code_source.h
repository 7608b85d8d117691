#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "isohf/archive/tile/quantise.h"
#include "isohf/convert/conversion.h"
#include "isohf/sampling/resample/tile_resampler.h"
#include "isohf/sampling/source/height_rows.h"

namespace isohf {

/// Heights and codes of tiles in a pass over all of them, in flat order. Each thread turns its tile's window of the source
/// into heights, small enough for a core's cache.
class CodeSource {
 public:
  /// `held_within` as TileResampler's limits. The conversion outlives it.
  CodeSource(const Conversion& conversion, const ElevationRange& held_within);
  /// Of a conversion whose codes' scale and offset are chosen.
  explicit CodeSource(const Conversion& conversion);
  ~CodeSource();

  /// What is known of a tile before it is cut, and the samples that it reads.
  struct Part {
    bool is_void = false;
    HeightRows::Held samples;
  };
  /// One thread, tiles in flat order. Reads the source.
  [[nodiscard]] Part read(TileIndex tile);

  /// heights [C x R] out, as TileResampler::cut. False, and they are left alone, where the tile has no elevation. Any
  /// thread.
  [[nodiscard]] bool heights(TileIndex tile, const Part& part, std::span<float> heights);
  /// heights, codes [C x R] out. Where a step and a bound on the rounding leave codes to choose from, that which is nearest
  /// to a smoothed source (docs/decisions/0067). nullopt, and codes are left alone, where the tile has no elevation. Any
  /// thread.
  [[nodiscard]] std::optional<QuantiserCounts> cut(TileIndex tile, const Part& part, std::vector<float>& heights,
                                                   TileCodes& codes);
  /// Calls make(flat index, part) for tiles `first` to `end`, on all threads of the caller's arena.
  void for_each(std::int64_t first, std::int64_t end, const std::function<void(std::int64_t, const Part&)>& make);

 private:
  struct Buffers;

  [[nodiscard]] bool cut(TileIndex tile, const Part& part, const Prefilter& prefilter, std::span<float> heights);

  const Conversion& conversion_;
  std::unique_ptr<TileResampler> cutter_;
  std::optional<Prefilter> smoothing_;  ///< where codes may be chosen
  HeightRows rows_;
  std::int64_t tile_row_ = -1;
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace isohf
