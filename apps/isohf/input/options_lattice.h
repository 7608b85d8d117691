#pragma once

#include <cstdint>

#include "isohf/convert.h"
#include "program.h"

namespace isohf::cli {

/// The shape of tiles: --shape, --levels.
void add_shape_options(CLI::App& line, PlanRequest& request);

/// How the lattice lies over the input: --density, --spacing, --fit, --outside. spacing_in_metres: --spacing
/// had a unit.
void add_lattice_options(CLI::App& line, PlanRequest& request, bool& spacing_in_metres);
/// Throws Error{kInvalidArgument} where it had one, and the input's world is in none that is known.
void check_spacing_unit(const SourceInfo& info, const PlanRequest& request, bool spacing_in_metres);

/// How elevations become codes: --type, --z-range, --clamp-range, --step, --max-rounding, --max-error.
void add_quantisation_options(CLI::App& line, ConvertOptions& options);

}  // namespace isohf::cli
