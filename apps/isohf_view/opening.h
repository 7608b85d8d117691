#pragma once

#include <memory>

#include "options.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Opens options.archive, or a raster, which is converted for as long as it is looked at. Throws Error naming the file.
[[nodiscard]] std::unique_ptr<TileSource> open_shown(const Options& options);

}  // namespace isohf::view
