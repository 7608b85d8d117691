#include "support/rasters/analytic_archive.h"

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/archive/writer.h"
#include "support/rasters/analytic_surface.h"

namespace isohf::test {

void write_analytic_archive(const std::string& path, const TileGrid& grid, const AlterTile& alter) {
  WriterOptions options;
  options.overwrite = true;
  options.job_fingerprint = "analytic";
  ArchiveWriter writer(path, grid, options);
  Metadata metadata(grid);
  metadata.quantisation = {CodeType::kU16, -20.0, 0.002};
  metadata.horizontal_unit = "metre";
  metadata.vertical_unit = "metre";
  metadata.valid = {0.0, 0.0, grid.world_width(), grid.world_height()};
  metadata.source.name = "analytic";
  metadata.source.format = "none";
  metadata.source.width = 1;
  metadata.source.height = 1;
  metadata.source.sample_type = "uint16";
  metadata.source.registration = Registration::kPoint;
  metadata.producer = "isohf test";
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    TileCodes tile;
    tile.codes = analytic_tile(grid, grid.tile_at(flat));
    if (alter) alter(grid.tile_at(flat), tile.codes);
    EncodedTile encoded = encode_tile(grid.shape(), tile);
    encoded.statistics.vertices = grid.shape().visible_vertex_count();
    encoded.statistics.min = metadata.quantisation.offset + metadata.quantisation.scale * encoded.code_min;
    encoded.statistics.max = metadata.quantisation.offset + metadata.quantisation.scale * encoded.code_max;
    writer.add_tile(encoded);
  }
  const TileStatistics all = writer.statistics();
  metadata.statistics.min = all.min;
  metadata.statistics.max = all.max;
  metadata.statistics.mean = 0.5 * (all.min + all.max);
  metadata.statistics.vertices = all.vertices;
  writer.finish(metadata);
}

}  // namespace isohf::test
