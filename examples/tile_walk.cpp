// Walks over the tiles of an archive: position, extent and range of each, as a renderer would load them.
//   tile_walk dem.isohf
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "isohf/isohf.h"

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: tile_walk ARCHIVE\n"), 2;
  try {
    const isohf::ArchiveReader archive(argv[1]);
    const isohf::TileGrid& grid = archive.grid();
    const isohf::TileShape& shape = grid.shape();
    std::printf("%lld x %lld tiles of %d x %d elevations\n", (long long)grid.tile_columns(),
                (long long)grid.tile_rows(), shape.columns(), shape.rows());
    for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
      const isohf::TileIndex tile = grid.tile_at(flat);
      if (!archive.tile_entry(tile).stored) continue;  // wholly nodata
      // Row by row, the border of one vertex included; NaN is nodata. Any thread may read any tile.
      const std::vector<double> elevations = archive.read_elevations(tile);
      double low = HUGE_VAL;
      double high = -HUGE_VAL;
      for (int row = 0; row < shape.rows(); ++row) {
        for (int column = 0; column < shape.columns(); ++column) {
          if (!isohf::is_visible(shape, {column, row})) continue;
          const double elevation = elevations[static_cast<std::size_t>(row * shape.columns() + column)];
          if (std::isnan(elevation)) continue;
          low = std::min(low, elevation);
          high = std::max(high, elevation);
        }
      }
      const isohf::WorldPoint corner = grid.world_from_object(tile, {0.0, 0.0});
      std::printf("tile (%lld,%lld) at x %g z %g: %.2f to %.2f\n", (long long)tile.column, (long long)tile.row,
                  corner.x, corner.z, low, high);
    }
    return 0;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
