#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "options.h"

namespace isohf::view {

/// Opens the archive and a window and lets a person fly until it is closed; with --json prints the last view. Throws
/// Error{kUnsupported} if no window or no OpenGL 3.3 can be had.
void run_window(const Options& options);

/// Prints an action's result as --json and --quiet ask for; `json` makes the document where it is wanted.
void print_result(const cli::Common& common, const std::string& text,
                  const std::function<nlohmann::ordered_json()>& json);

}  // namespace isohf::view
