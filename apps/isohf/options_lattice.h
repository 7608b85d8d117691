#pragma once

#include <cstdint>

#include "command_line.h"
#include "isohf/convert/convert.h"
#include "isohf/convert/plan.h"

namespace isohf::cli {

/// The shape of tiles: --shape, --levels, --triangles, --vertices.
void add_shape_options(CommandLine& line, PlanRequest& request);

/// How the lattice lies over the input: --density, --spacing, --tiles, --fit, --outside.
void add_lattice_options(CommandLine& line, PlanRequest& request);

/// --type u16|u8|f32.
void add_code_type_option(CommandLine& line, CodeType& type);

/// How elevations become codes: --type, --z-range, --step, --clamp-range.
void add_quantisation_options(CommandLine& line, ConvertOptions& options);

}  // namespace isohf::cli
