#pragma once

#include <string>
#include <vector>

#include "isohf/error.h"

namespace isohf::cli {

/// What follows the program's or the command's name on the command line.
using Arguments = std::vector<std::string>;

/// How the programs end (docs/cli.md).
enum ExitCode : int {
  kExitDone = 0,
  kExitFailed = 1,
  kExitUsage = 2,
  kExitDifferences = 3,  ///< verify found something, restore not what --lossless kept
  kExitInterrupted = 130,
};

/// What a program ends with after an error of that code.
[[nodiscard]] int exit_code_for(ErrorCode code);

/// What main() is: runs `body`, and turns what it throws into one line on standard error and an exit code. `name` is
/// how messages and help call the program.
int run_program(const char* name, int argc, char** argv, int (*body)(const Arguments& arguments));

/// "isohf 0.1.0" on standard output.
void print_version();

/// The name that run_program() was given.
[[nodiscard]] const std::string& program_name();

/// Becomes the program `name`, which lies beside this one or on the path, with the same descriptors. Throws Error where
/// it is not installed.
[[noreturn]] void become_program(const std::string& name, const Arguments& arguments);

}  // namespace isohf::cli
