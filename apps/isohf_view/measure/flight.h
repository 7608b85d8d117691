#pragma once

#include <functional>

#include "options.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Flies along options.flight offscreen, prints figures on standard output, writes --csv and --plot. `poll` is called
/// before each frame and may throw. Throws Error{kCorrupt} where a tile cannot be read.
void fly(const TileSource& source, const Options& options, const std::function<void()>& poll);

}  // namespace isohf::view
