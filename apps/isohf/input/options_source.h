#pragma once

#include <string>

#include "formats/registry.h"
#include "isohf/raster.h"
#include "program.h"

namespace isohf::cli {

/// How an input is read: --channel, --part, --encoding, --registration, --nodata, --valid-range, --fill, --z-scale,
/// --z-offset, --raw, --sample-spacing, --crs.
void add_source_options(CLI::App& line, OpenOptions& options);
/// Of these --channel and --part, and --raw.
void add_part_options(CLI::App& line, OpenOptions& options);
void add_raw_option(CLI::App& line, OpenOptions& options);

/// A reference system as an option's value has it: what is called so is a file that holds the text (a .prj), else the
/// text itself. Throws Error{kInvalidArgument} for nothing, and for a file that holds no text.
[[nodiscard]] std::string system_from(const std::string& text);

}  // namespace isohf::cli
