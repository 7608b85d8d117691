#pragma once

#include <string>
#include <vector>

#include "isohf/convert/plan.h"

namespace isohf {

/// What a plan has that nobody asked for: a density below 0.5 or above 2. One line each, with the figure and a remedy.
[[nodiscard]] std::vector<std::string> plan_warnings(const SourceInfo& info, const Plan& plan,
                                                     const PlanRequest& request);

}  // namespace isohf
