#pragma once

#include "isohf/convert.h"
#include "options/options_common.h"

namespace isohf::cli {

/// What `isohf plan INPUT` and `isohf convert --dry-run` print: the plan as text, or as JSON; the input's warnings on
/// standard error.
void print_plan(HeightSource& source, const ConvertOptions& options, const Job& job, const CommonOptions& common);

/// The same text on standard error, for -v.
void print_plan_notes(HeightSource& source, const ConvertOptions& options, const Job& job);

}  // namespace isohf::cli
