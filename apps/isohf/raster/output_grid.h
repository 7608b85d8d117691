#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "isohf/metadata.h"
#include "isohf/raster.h"
#include "isohf/restore/geo_rows.h"
#include "isohf/restore/surface_rows.h"

namespace isohf::cli {

/// The samples of a raster that is written.
struct OutputGrid {
  OutputGrid() = default;
  explicit OutputGrid(const SampleGrid& grid) : world(grid) {}

  SampleGrid world;                ///< where they lie; but for width and height it says nothing where `degrees` is set
  std::optional<GeoGrid> degrees;  ///< samples in degrees, whose rows are no rows of the archive's world
  Registration registration = Registration::kArea;  ///< of those
};

using GridSize = std::pair<std::int64_t, std::int64_t>;  ///< columns, rows

/// Samples over a part of the world: in the middle of areas, or on posts from its first edge to its last.
/// size     so many; else as many as `spacing` gives, which is also their distance where both are given
[[nodiscard]] SampleGrid grid_over(const WorldBounds& ground, bool area, const std::optional<GridSize>& size,
                                   const std::optional<double>& spacing);

/// True where the surface may have no elevation at a sample of the grid.
[[nodiscard]] bool may_have_voids(const Metadata& metadata, const SampleGrid& grid);

/// A raster that is cut into tiles, each as large as the others and sharing `overlap` samples with its neighbours.
struct TileCut {
  std::int64_t across = 1;
  std::int64_t down = 1;
  std::int64_t columns = 0;  ///< of a tile
  std::int64_t rows = 0;
  std::int64_t overlap = 0;
  bool asked = false;  ///< every file is named by its place then, even a single one
};

/// How a raster of `size` samples is cut. Where `free` is set, its size is nobody's wish: that of the nearest number of
/// whole tiles is taken, into `size`. Throws Error{kInvalidArgument} naming the nearest sizes where tiles do not come
/// out whole, and where overlap leaves a tile nothing of its own. count      tiles across and down; nullopt: as many as
/// fit tile_size  samples of a tile; nullopt: the size divided
[[nodiscard]] TileCut cut_into_tiles(GridSize& size, bool free, const std::optional<GridSize>& count,
                                     const std::optional<GridSize>& tile_size, std::int64_t overlap);

}  // namespace isohf::cli
