#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace isohf::cli {

/// Reads --config files by toml++, for their lines and their types. A key is a long option without dashes: at the top
/// level for every command that has the option, in a [section] for the command of that name. The command line goes
/// before the section, and the section before the top level.
class TomlConfig : public CLI::ConfigBase {
 public:
  /// root  the program; its command line has been parsed when a file is read
  explicit TomlConfig(const CLI::App& root) : root_(root) {}

  /// What the file says for the command in hand. Throws Error{kInvalidArgument}, which begins with file and line, for
  /// what is not TOML, no option of any command, or a value that no option of that kind takes.
  [[nodiscard]] std::vector<CLI::ConfigItem> from_config(std::istream& input) const override;

  /// Where an option's value stands, for messages: "FILE:LINE: density", or "--density" if it was typed.
  [[nodiscard]] std::string place_of(const std::string& option) const;

 private:
  const CLI::App& root_;
  mutable std::map<std::string, std::string> places_;  ///< by the option's name
};

}  // namespace isohf::cli
