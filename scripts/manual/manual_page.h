#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace isohf::cli {

/// A page of the manual, in roff: of the program if `line` is its root, else of a command.
[[nodiscard]] std::string manual_page(const CLI::App& line);

}  // namespace isohf::cli
