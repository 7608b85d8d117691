#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <span>
#include <string>

#include "common.h"

namespace isohf::cli {

/// Runs a command whose options have been parsed; returns its exit code. Throws Error.
using Run = std::function<int()>;

/// A command: declares its options, and returns what runs it. Options are declared before they are parsed: `add`
/// touches no file.
struct Command {
  const char* name;
  const char* summary;  ///< for the list of commands
  const char* heading;  ///< that it stands under in that list
  Run (*add)(CLI::App& line, Common& common);
  const char* program = nullptr;  ///< the program that it becomes instead, with all other words of the command line
};

/// A program. One with a single command of the same name ("isohf-view" and "view") is called without it.
struct Program {
  const char* name;
  const char* summary;
  const char* footer;  ///< of its --help
  std::span<const Command> commands;

  [[nodiscard]] bool has_commands() const { return commands.size() > 1; }
};

/// Declares everything in `root`, which the command line, the manual and the completions are made from.
std::map<const CLI::App*, Run> declare(const Program& program, CLI::App& root, Common& common);

/// Parses and runs; what is thrown becomes one line on common.err. Returns the exit code.
int run(const Program& program, const Arguments& arguments, Common common = {});

/// What main() is: signals and descriptors made ready, then run().
int run_main(const Program& program, int argc, char** argv);

}  // namespace isohf::cli
