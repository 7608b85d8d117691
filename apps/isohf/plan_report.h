#pragma once

#include "isohf/convert/plan.h"
#include "options_common.h"

namespace isohf::cli {

/// What `isohf plan INPUT` and `isohf convert --dry-run` print: the plan as text, or as JSON; the input's warnings on
/// standard error.
void print_plan(const SourceInfo& info, const Plan& plan, CodeType code_type, const CommonOptions& common);

/// The same text on standard error, for -v.
void print_plan_notes(const SourceInfo& info, const Plan& plan, CodeType code_type);

}  // namespace isohf::cli
