#pragma once

#include "program.h"

namespace isohf::cli {

/// The commands, as Command::run is.

int command_convert(const Arguments& arguments);
int command_diff(const Arguments& arguments);
int command_export(const Arguments& arguments);
int command_extract(const Arguments& arguments);
int command_formats(const Arguments& arguments);
int command_info(const Arguments& arguments);
int command_merge(const Arguments& arguments);
int command_plan(const Arguments& arguments);
int command_sample(const Arguments& arguments);
int command_shade(const Arguments& arguments);
int command_verify(const Arguments& arguments);
int command_view(const Arguments& arguments);

}  // namespace isohf::cli
