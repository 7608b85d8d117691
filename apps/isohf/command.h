#pragma once

#include "program.h"

namespace isohf::cli {

/// A command: parses its arguments, which touches no file but --config, and runs. Throws Error.
using CommandFunction = int (*)(const Arguments& arguments);

int command_convert(const Arguments& arguments);
int command_export(const Arguments& arguments);
int command_formats(const Arguments& arguments);
int command_info(const Arguments& arguments);
int command_plan(const Arguments& arguments);
int command_restore(const Arguments& arguments);
int command_sample(const Arguments& arguments);
int command_shade(const Arguments& arguments);
int command_verify(const Arguments& arguments);

}  // namespace isohf::cli
