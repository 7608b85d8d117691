#pragma once

#include "command_line.h"
#include "formats/registry.h"

namespace isohf::cli {

/// What a user may say about an input: --channel, --part, --encoding, --registration, --nodata, --z-scale, --z-offset,
/// --raw,
/// --sample-spacing.
void add_source_options(CommandLine& line, OpenOptions& options);

}  // namespace isohf::cli
