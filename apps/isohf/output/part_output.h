#pragma once

#include <functional>
#include <string>

#include "isohf/job.h"
#include "isohf/parts.h"
#include "options/work_options.h"

namespace isohf::cli {

/// Runs what copies tiles to an archive, and prints what came of it. Returns the exit code.
int print_part(const std::string& output, const Common& common, const WorkOptions& work,
               const std::function<PartSummary(const Job&)>& write);

}  // namespace isohf::cli
