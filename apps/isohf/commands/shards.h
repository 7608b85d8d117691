#pragma once

#include <string>
#include <vector>

#include "isohf/shards.h"
#include "program.h"

namespace isohf::cli {

// One conversion on many machines; each returns the exit code.

/// isohf plan INPUT... --write FILE
int write_plan(const Arguments& arguments);
/// isohf convert --plan PLAN --shard K/N -o PART
int convert_shard_of(const Arguments& arguments);

/// A plan file. Throws Error{kIo, kCorrupt, kUnsupported}.
[[nodiscard]] ShardPlan read_plan(const std::string& path);
/// Whether a file may be a plan: it begins as JSON does.
[[nodiscard]] bool looks_like_plan(const std::string& path);

}  // namespace isohf::cli
