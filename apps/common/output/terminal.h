#pragma once

#include <string>
#include <string_view>

namespace isohf::cli {

/// Columns for text in `file`: COLUMNS or the terminal's, 80 to 120; 80 if there is no terminal.
[[nodiscard]] std::size_t text_width(int file);
/// Columns of the terminal behind `file`; 0 where there is none, or one that moves no cursor (TERM=dumb).
[[nodiscard]] std::size_t terminal_columns(int file);

enum class Style { kHeading, kError, kWarning };
/// `text` with the escape codes of a style where `file` takes them: a terminal does unless TERM=dumb or NO_COLOR is
/// set; CLICOLOR_FORCE gives them to pipes and files too.
[[nodiscard]] std::string styled(std::string_view text, Style style, int file);

}  // namespace isohf::cli
