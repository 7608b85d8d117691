#include "isohf/convert/stages/tiles_around.h"

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
  const std::int64_t first = rows.first * grid.tile_columns();
  const std::int64_t end = (rows.last + 1) * grid.tile_columns();
  for (std::int64_t flat = first; flat < end; ++flat) tiles_[flat].is_empty = true;
  source.for_each(first, end, [&](std::int64_t flat, const CodeSource::Part& part) {
    std::vector<float> heights;
    TileCodes codes;
    if (source.cut(grid.tile_at(flat), part, heights, codes))
      tiles_.at(flat) = encode_tile(grid.shape(), codes, Effort::kFast);
  });
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
