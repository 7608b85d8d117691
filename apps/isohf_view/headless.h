#pragma once

#include "options.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Refuses files to write that exist without --overwrite, or that are the archive. Throws Error.
void check_outputs(const Options& options);

/// Does what the options ask for without a screen; the exit code. Throws Error.
[[nodiscard]] int run_headless(const TileSource& source, const Options& options);

}  // namespace isohf::view
