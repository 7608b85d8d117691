#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "program.h"

namespace isohf::cli {

/// A command of the program.
struct Command {
  const char* name;
  const char* summary;
  int (*run)(const Arguments& arguments);  ///< parses, which touches no file but --config, and runs. Throws Error
};

/// The command line of one command: its options, its help, and the parsing of both.
///
/// Options are listed in --help under the group that was named last, in the order of their declaration. Values arrive
/// as text; the function that takes one throws Error{kInvalidArgument} with "found ..., must be ...", to which the
/// option's name, or file and line, are added. An option that is given twice is an error. Every long option may also
/// stand in the --config file: at its top level, which is for every command that knows the option, or in the command's
/// own section. A section goes before the top level, and the command line before both.
///
/// A program that is named after its command ("isohf-view" for "view") is called without it.
class CommandLine {
 public:
  using Take = std::function<void(const std::string& text)>;

  CommandLine(const std::string& command, const std::string& summary);
  ~CommandLine();
  CommandLine(const CommandLine&) = delete;
  CommandLine& operator=(const CommandLine&) = delete;

  void group(const std::string& title);
  /// A value without a name; `flags` ("-o,--output") name it as well.
  void positional(const std::string& name, const std::string& description, std::string& value);
  void positional(const std::string& name, const std::string& flags, const std::string& description,
                  std::string& value);
  /// All values without a name that no other positional takes; `usage` is how they are shown: "INPUT... OUTPUT",
  /// "[INPUT...]".
  void positionals(const std::string& usage, const std::string& description, std::vector<std::string>& values);
  void option(const std::string& flags, const std::string& value_name, const std::string& description, Take take);
  void option(const std::string& flags, const std::string& value_name, const std::string& description,
              std::string& value);
  /// An option that may be given again and again; values are appended.
  void repeated(const std::string& flags, const std::string& value_name, const std::string& description,
                std::vector<std::string>& values);
  /// An option of two values that may be given again and again.
  void repeated_pair(const std::string& flags, const std::string& value_name, const std::string& description,
                     std::function<void(const std::string&, const std::string&)> take);
  /// Words that the option declared last may begin with, to suggest the nearest where its value is refused.
  void words(const std::vector<std::string>& words);
  /// `given` is called where the flag is set, also by the --config file.
  void flag(const std::string& flags, const std::string& description, bool& value,
            std::function<void()> given = nullptr);
  void flag(const std::string& flags, const std::string& description, std::function<void()> given);
  /// At most one of these long options may be given.
  void exclusive(const std::vector<std::string>& options);
  /// What --help ends with: examples and notes.
  void footer(const std::string& text);

  /// Parses. False: help or the version was asked for and printed, there is nothing to run. Throws
  /// Error{kInvalidArgument}.
  [[nodiscard]] bool parse(const Arguments& arguments);
  /// The same of the options that an archive records, by name without dashes, and their text: none but those that were
  /// declared here. Throws Error{kInvalidArgument} naming the option.
  void parse_recorded(const std::vector<std::pair<std::string, std::string>>& texts);
  /// Whether the long option is on the command line or in the command's own section of the --config file. (The file's
  /// top level is for all commands: what does not fit one of them there is no mistake.)
  [[nodiscard]] bool given(const std::string& option) const;
  /// The first option of these groups that is given(); empty where none is.
  [[nodiscard]] std::string first_given(const std::vector<std::string>& groups) const;
  /// Throws Error{kInvalidArgument}: the options do not go together.
  [[noreturn]] void fail(const std::string& why) const;
  /// The options of these groups that parse() met, on the command line or in the --config file, and their text; "true"
  /// for a flag.
  [[nodiscard]] std::vector<std::pair<std::string, std::string>> texts_in(const std::vector<std::string>& groups) const;
  /// Throws Error{kInvalidArgument} for a positional that is empty after parsing.
  void require(const std::string& name, const std::string& value) const;
  void require(const std::string& name, const std::vector<std::string>& values) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// An option as its command declares it.
struct DeclaredOption {
  std::string name;    ///< "--threads"
  std::string letter;  ///< "-j", or empty
  std::string group;
  bool takes_value = false;
};

/// The options of a command, which declares them and runs no further.
[[nodiscard]] std::vector<DeclaredOption> options_of(const Command& command);
/// Names the program's commands, so that an option of another one can be told from one that none knows.
void set_commands(std::span<const Command> commands);

}  // namespace isohf::cli
