#pragma once

#include <functional>
#include <string>

#include "isohf/job.h"
#include "isohf/parts.h"
#include "options/options_common.h"

namespace isohf::cli {

/// Runs what writes a part or a whole, and prints what came of it. Returns the exit code.
int print_part(const std::string& output, const CommonOptions& common, const WorkOptions& work,
               const std::function<PartSummary(const Job&)>& write);

/// "columns 0 to 39, rows 0 to 11".
[[nodiscard]] std::string describe_tiles(const TileRange& tiles);

}  // namespace isohf::cli
