#pragma once

#include <memory>
#include <optional>

#include "isohf/restore/sample_grids.h"

namespace isohf {

/// The samples that a raster of an archive is to have: without any of these the source's.
struct ExportGridRequest {
  std::optional<GridSize> size = {};
  std::optional<double> spacing = {};  ///< > 0
  bool spacing_in_metres = false;      ///< else in the units of the system in which the grid is chosen, or of the world
  std::shared_ptr<const GridSystem> system = nullptr;  ///< nullptr: the source's, which has been understood
  bool on_own_map = false;                             ///< the archive's map, instead of `system`
  std::optional<MapBounds> box = {};                   ///< only this part, in the source's coordinates
};

/// Whether the box counts in the source's system alone: it need not lie in the world.
[[nodiscard]] bool is_cut_in_source(const Metadata& metadata, const ExportGridRequest& request);

/// Throws Error{kInvalidArgument} for a spacing in metres if the units are not known to be these, and if no sample lies
/// in the box.
[[nodiscard]] SampleGrid export_grid(const Metadata& metadata, const ExportGridRequest& request);

/// The tile of a grid that begins `column` and `row` samples from its first one.
[[nodiscard]] SampleGrid window_of(const SampleGrid& grid, std::int64_t column, std::int64_t row, const GridSize& size);

/// Georeferences a raster of no known place by the archive's North-West corner: tiles lie beside each other.
void place_in_world(const SampleGrid& grid, std::optional<Georeference>& georeference);

}  // namespace isohf
