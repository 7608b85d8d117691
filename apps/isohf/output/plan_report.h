#pragma once

#include "isohf/convert.h"
#include "options/work_options.h"

namespace isohf::cli {

/// What `isohf plan INPUT` prints: the plan as text, or as JSON; the input's warnings on
/// standard error.
void print_plan(HeightSource& source, const ConvertOptions& options, const Job& job, const Common& common);

/// The same text on standard error, for convert -v.
void print_plan_notes(HeightSource& source, const ConvertOptions& options, const Job& job, const Common& common);

}  // namespace isohf::cli
