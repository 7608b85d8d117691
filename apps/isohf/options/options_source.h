#pragma once

#include <memory>
#include <string>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "options/command_line.h"

namespace isohf::cli {

/// The group "Input", what a user may say about an input: --channel, --part, --encoding, --registration, --nodata,
/// --valid-range, --fill,
/// --fill-distance, --z-scale, --z-offset, --raw, --sample-spacing, --crs.
void add_source_options(CommandLine& line, OpenOptions& options);

/// A reference system as an option's value has it: what is called so is a file that holds the text (a .prj), else the
/// text itself. Throws Error{kInvalidArgument} for nothing, and for a file that holds no text.
[[nodiscard]] std::string system_from(const std::string& text);

/// Opens the input with all of them: its voids are treated as options.voids says.
[[nodiscard]] std::unique_ptr<HeightSource> open_input(const std::string& path, const OpenOptions& options);

}  // namespace isohf::cli
