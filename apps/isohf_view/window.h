#pragma once

#include "options.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Opens a window and lets a person fly until it is closed, or for options.frames frames; writes options.screenshot of
/// the last frame where asked. Throws Error{kUnsupported} where no window or no OpenGL 3.3 can be had.
void run_window(const TileSource& source, const Options& options);

}  // namespace isohf::view
