#pragma once

#include "formats/io/option_text.h"
#include "formats/registry.h"
#include "isohf/fill/geoid_source.h"
#include "isohf/raster.h"
#include "program.h"

namespace isohf::cli {

/// How an input is read: --channel, --part, --encoding, --registration, --nodata, --valid-range, --fill, --z-scale,
/// --z-offset, --raw, --sample-spacing, --crs.
void add_source_options(CLI::App& line, OpenOptions& options);
/// Of these --channel, --part and --encoding; --raw; --z-scale and --z-offset.
void add_part_options(CLI::App& line, OpenOptions& options);
void add_raw_option(CLI::App& line, OpenOptions& options);
void add_scale_options(CLI::App& line, OpenOptions& options);
/// --geoid FILE.pgm[:to-ellipsoidal|to-orthometric].
CLI::Option* add_geoid_option(CLI::App& line, GeoidRequest& request);

}  // namespace isohf::cli
