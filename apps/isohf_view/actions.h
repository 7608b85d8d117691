#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "options.h"
#include "paging/tile_source.h"

namespace isohf::view {

/// Opens the archives and a window and lets a person fly until it is closed, or for options.frames frames; writes
/// options.screenshot of the last frame where asked, and with --json says where the eye stood at the end. Throws Error{kUnsupported} where no window or no OpenGL 3.3 can be had.
void run_window(const Options& options);

/// Flies along options.flight offscreen, prints figures on standard output, writes --csv and --plot. `poll` is called
/// before each frame and may throw. Throws Error{kCorrupt} where a tile cannot be read.
void fly(const TileSource& source, const Options& options, const std::function<void()>& poll);

/// Sweeps through the levels of detail, fading and switching, prints how the picture changes, and writes --csv. `poll` as
/// in fly().
void sweep(const TileSource& source, const Options& options, const std::function<void()>& poll);

/// Prints an action's result as --json and --quiet ask for; `json` makes the document where it is wanted.
void print_result(const cli::CommonOptions& common, const std::string& text,
                  const std::function<nlohmann::ordered_json()>& json);

}  // namespace isohf::view
