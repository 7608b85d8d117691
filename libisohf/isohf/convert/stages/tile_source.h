#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "isohf/convert/conversion.h"
#include "isohf/sampling/resample/tile_resampler.h"
#include "isohf/sampling/source/band_reader.h"
#include "isohf/sampling/source/source_rows.h"

namespace isohf {

/// The heights of tiles in a pass over all of them, in flat order. Where the kernel has no prefilter a tile's own
/// piece of the source is turned into heights, small enough for a core's cache, by the thread that cuts the tile; with
/// one, bands of as many tiles as memory allows are filtered first.
class TileSource {
 public:
  /// `limits` as TileResampler's. `prefilter` is the kernel's, or smooths. The conversion outlives it.
  TileSource(const Conversion& conversion, const ElevationRange& limits, const Prefilter& prefilter);
  ~TileSource();

  /// Tiles of one row that are cut from the same rows of the source.
  struct Part {
    std::int64_t tile_row = 0;
    std::int64_t first_column = 0;
    std::int64_t end_column = 0;
    RowRange rows{0, -1};
    std::shared_ptr<const RawRows> raw;
    std::shared_ptr<const Band> band;  ///< instead of raw, where there is a prefilter

    [[nodiscard]] bool holds(TileIndex tile) const {
      return tile.row == tile_row && tile.column >= first_column && tile.column < end_column;
    }
  };
  /// The part that holds `tile`. One thread, tiles in flat order. No tile may be cut from a part that more tiles than
  /// MemoryPlan::tiles_in_flight have entered after.
  [[nodiscard]] std::shared_ptr<const Part> read(TileIndex tile);

  /// heights [C x R] out, as TileResampler::cut. False, and nothing is done, where none of the samples under the tile has
  /// an elevation. Any thread.
  [[nodiscard]] bool cut(TileIndex tile, const Part& part, std::span<float> heights) const;

 private:
  struct Windows;

  const Conversion& conversion_;
  Prefilter prefilter_;
  std::unique_ptr<TileResampler> cutter_;
  bool cuts_windows_;  ///< tiles have their own pieces of the source
  bool reads_whole_rows_;
  std::vector<RowRange> columns_needed_;  ///< by tile column
  SourceRows rows_;
  BandReader bands_;
  std::unique_ptr<Windows> windows_;
};

}  // namespace isohf
