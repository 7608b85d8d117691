#pragma once

#include <string>
#include <vector>

#include "output/standard_output.h"

namespace isohf::cli {

/// What follows the program's or the command's name on the command line.
using Arguments = std::vector<std::string>;

/// What main() is: runs `body`, and turns what it throws into one line on standard error and an exit code. `name` is
/// how messages and help call the program.
int run_program(const char* name, int argc, char** argv, int (*body)(const Arguments& arguments));

/// "isohf 0.1.0" on standard output, or a document with --json.
void print_version();

/// Becomes the program `name`, which lies beside this one or on the path, with the same descriptors. Throws Error where
/// it is not installed.
[[noreturn]] void become_program(const std::string& name, const Arguments& arguments);

}  // namespace isohf::cli
