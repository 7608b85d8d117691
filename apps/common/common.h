#pragma once

#include <string>
#include <vector>

namespace isohf::cli {

/// What follows the program's name on the command line.
using Arguments = std::vector<std::string>;

/// How the programs end (docs/cli.md).
enum ExitCode : int {
  kExitDone = 0,
  kExitFailed = 1,
  kExitUsage = 2,
  kExitDifferences = 3,  ///< verify or diff found some
  kExitInterrupted = 130,
  kExitOutputClosed = 141,  ///< as a shell reports SIGPIPE
};

/// What every command is run with: its name, its streams, and the options that all commands have.
struct Common {
  std::string name;         ///< begins messages: "isohf convert"
  bool json = false;        ///< --json: results, and an error, are JSON documents on standard output
  bool quiet = false;       ///< -q: of warnings only those of lost data
  bool verbose = false;     ///< -v
  bool strict = false;      ///< --strict: a warning is an error
  bool json_notes = false;  ///< --progress json: every line on standard error is a JSON object
  int in = 0;               ///< file descriptors: standard input, output and error
  int out = 1;
  int err = 2;
};

}  // namespace isohf::cli
