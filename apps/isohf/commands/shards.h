#pragma once

#include "input/convert_setup.h"

namespace isohf::cli {

/// isohf convert INPUT... -o PART --shard K/N: one conversion on many machines. Returns the exit code.
int convert_shard_of(ConvertCommandOptions options);

}  // namespace isohf::cli
