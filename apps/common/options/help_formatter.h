#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "common.h"

namespace isohf::cli {

/// Lays out help as wide as the terminal: all of it (--help), or the usage and the most used options (-h).
class HelpFormatter : public CLI::FormatterBase {
 public:
  explicit HelpFormatter(const Common& common) : common_(common) {}

  std::string make_help(const CLI::App* line, std::string name, CLI::AppFormatMode mode) const override;

 private:
  const Common& common_;
};

/// "isohf export ARCHIVE OUTPUT [options]".
[[nodiscard]] std::string usage_of(const CLI::App& line);
/// "-o, --output OUTPUT"; of a positional its name.
[[nodiscard]] std::string shown_name(const CLI::Option& option);

/// The options of a command under their headings, in the order of declaration, those most used first.
[[nodiscard]] std::vector<std::pair<std::string, std::vector<const CLI::Option*>>> by_heading(const CLI::App& line);

}  // namespace isohf::cli
