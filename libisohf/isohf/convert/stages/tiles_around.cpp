#include "isohf/convert/stages/tiles_around.h"

#include <oneapi/tbb/parallel_for.h>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/convert/stages/code_source.h"

namespace isohf {

TilesAround::TilesAround(const Conversion& conversion, const RowRange& north, const RowRange& south)
    : conversion_(conversion) {
  make(north);
  make(south);
}

void TilesAround::make(const RowRange& rows) {
  const TileGrid& grid = conversion_.plan.grid;
  CodeSource source(conversion_);
  std::int64_t next = rows.first * grid.tile_columns();
  const std::int64_t end = (rows.last + 1) * grid.tile_columns();
  while (next < end) {
    conversion_.job.throw_if_cancelled();
    const std::int64_t first = next;
    const std::shared_ptr<const CodeSource::Part> part = source.read(grid.tile_at(first));
    while (next < end && part->holds(grid.tile_at(next))) ++next;
    std::vector<EncodedTile> made(static_cast<std::size_t>(next - first));
    oneapi::tbb::parallel_for(std::size_t{0}, made.size(), [&](std::size_t i) {
      std::vector<float> heights;
      TileCodes codes;
      made[i].is_empty = true;
      if (!source.cut(grid.tile_at(first + static_cast<std::int64_t>(i)), *part, heights, codes)) return;
      made[i] = encode_tile(grid.shape(), codes, Effort::kFast);
    });
    for (std::size_t i = 0; i < made.size(); ++i) tiles_[first + static_cast<std::int64_t>(i)] = std::move(made[i]);
  }
}

TileCodes TilesAround::codes(TileIndex tile) const {
  const TileShape& shape = conversion_.plan.grid.shape();
  const EncodedTile& made = entry(tile);
  if (made.is_empty) return void_tile(shape, conversion_.quantisation);
  std::vector<std::byte> payload(made.payload_bytes);
  inflate_exactly(made.deflated, payload);
  return decode_tile(shape, conversion_.quantisation.type, payload);
}

std::uint64_t TilesAround::memory_bytes(const TileGrid& grid, std::int64_t rows) {
  constexpr double kWaitingBytes = 1.3;  // as of tiles that wait to be written
  return static_cast<std::uint64_t>(kWaitingBytes * static_cast<double>(rows) *
                                    static_cast<double>(grid.tile_columns()) *
                                    static_cast<double>(grid.shape().stored_vertex_count()));
}

}  // namespace isohf
