#pragma once

#include <cstdint>

#include "isohf/convert.h"
#include "options/command_line.h"

namespace isohf::cli {

/// The shape of tiles: --shape, --levels.
void add_shape_options(CommandLine& line, PlanRequest& request);

/// How the lattice lies over the input: --density, --spacing, --tiles, --fit, --outside. spacing_in_metres: --spacing
/// had a unit.
void add_lattice_options(CommandLine& line, PlanRequest& request, bool& spacing_in_metres);
/// Throws Error{kInvalidArgument} where it had one, and the input's world is in none that is known.
void check_spacing_unit(const SourceInfo& info, const PlanRequest& request, bool spacing_in_metres);

/// --type u16|u8|f32.
void add_code_type_option(CommandLine& line, CodeType& type);

/// How elevations become codes: --type, --z-range, --step, --clamp-range.
void add_quantisation_options(CommandLine& line, ConvertOptions& options);

}  // namespace isohf::cli
