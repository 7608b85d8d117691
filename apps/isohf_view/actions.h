#pragma once

#include "options.h"

namespace isohf::view {

/// Opens the archive and a window and lets a person fly until it is closed; with --json prints the last view. Throws
/// Error{kUnsupported} if no window or no OpenGL 3.3 can be had.
void run_window(const Options& options);

}  // namespace isohf::view
