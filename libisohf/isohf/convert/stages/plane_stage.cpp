#include "isohf/convert/stages/plane_stage.h"

#include "isohf/archive/tile/tile_encoder.h"

namespace isohf {

PlaneStage::PlaneStage(const Planes& planes, const Quantisation& quantisation, Effort effort, ArchiveWriter& writer,
                       const RowRange& rows, const TilesAround* around, const ScratchFolder& scratch)
    : around_(around) {
  builder_.emplace(
      planes, quantisation.type,
      [shape = planes.grid(0).shape(), effort](const TileCodes& codes) { return encode_tile(shape, codes, effort); },
      [&writer, rows, planes](int plane, TileIndex tile, const EncodedTile& encoded) {
        const std::int64_t height = planes.scale(plane);  // in rows of tiles
        const bool is_ours = tile.row * height <= rows.last && (tile.row + 1) * height > rows.first;
        if (is_ours && !encoded.is_empty)
          writer.add_plane_tile(plane, tile, encoded, {encoded.code_min, encoded.code_max});
      },
      scratch);
  const std::int64_t tiles = writer.next_tile();
  if (tiles == 0) return;
  // What followed the last tile is no longer there: the writer goes on behind that tile itself.
  writer.flush_tiles();
  const auto read = [&](int plane, TileIndex tile) {
    const TileEntry entry = writer.tile_entry(tile, plane);
    PlaneBuilder::Stored stored;
    if (plane == 0 && around_ != nullptr && around_->holds(tile)) {
      stored.entry = around_->entry(tile);
      stored.codes = around_->codes(tile);
      return stored;
    }
    stored.entry.is_empty = !entry.stored;
    stored.entry.code_min = entry.code_min;
    stored.entry.code_max = entry.code_max;
    if (entry.stored) stored.codes = writer.read_tile(tile, quantisation, plane);
    return stored;
  };
  builder_->resume_after(tiles - 1, read);
  const PlaneBuilder::Stored last = read(0, planes.grid(0).tile_at(tiles - 1));
  builder_->add(sample(last.codes, last.entry));
}

std::unique_ptr<Stage::Made> PlaneStage::make(TileIndex, const TileCodes& codes, const EncodedTile& encoded) const {
  if (encoded.is_empty) return nullptr;
  return std::make_unique<MadeOf<PlaneSample>>(sample(codes, encoded));
}

void PlaneStage::add_after(TileIndex, const Made* made, ArchiveWriter&) {
  add(made == nullptr ? PlaneSample() : static_cast<const MadeOf<PlaneSample>*>(made)->value);
}

void PlaneStage::pass_over(TileIndex tile) {
  const bool is_known = around_ != nullptr && around_->holds(tile);
  add(is_known ? sample(around_->codes(tile), around_->entry(tile)) : PlaneSample());
}

}  // namespace isohf
