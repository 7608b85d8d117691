#include "isohf/convert/stages/plane_stage.h"

#include "isohf/archive/codec/tile_encoder.h"

namespace isohf {

PlaneStage::PlaneStage(const Planes& planes, const Quantisation& quantisation, int level, ArchiveWriter& writer)
    : builder_(
          planes, quantisation.type,
          [shape = planes.grid(0).shape(), level](const TileCodes& codes) { return encode_tile(shape, codes, level); },
          [&writer](int plane, TileIndex tile, const EncodedTile& encoded) {
            if (!encoded.is_empty) writer.add_plane_tile(plane, tile, encoded, {encoded.code_min, encoded.code_max});
          }) {
  const std::int64_t tiles = writer.next_tile();
  if (tiles == 0) return;
  // What followed the last tile is no longer there: the writer goes on behind that tile itself.
  writer.flush_tiles();
  const auto read = [&](int plane, TileIndex tile) {
    const TileEntry entry = writer.tile_entry(tile, plane);
    PlaneBuilder::Stored stored;
    stored.entry.is_empty = !entry.stored;
    stored.entry.code_min = entry.code_min;
    stored.entry.code_max = entry.code_max;
    if (entry.stored) stored.codes = writer.read_tile(tile, quantisation, plane);
    return stored;
  };
  builder_.resume_after(tiles - 1, read);
  const PlaneBuilder::Stored last = read(0, planes.grid(0).tile_at(tiles - 1));
  builder_.add(sample(last.codes, last.entry));
}

}  // namespace isohf
