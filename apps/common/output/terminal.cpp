#include "output/terminal.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>

namespace isohf::cli {
namespace {

constexpr std::size_t kLeastWidth = 80;
constexpr std::size_t kMostWidth = 120;

std::string_view setting(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? std::string_view() : std::string_view(value);
}

/// Whether a terminal is behind `file` that understands escape codes.
bool takes_escapes(int file) {
  return ::isatty(file) != 0 && !setting("TERM").empty() && setting("TERM") != "dumb";
}

}  // namespace

std::size_t terminal_columns(int file) {
  struct winsize size {};
  if (!takes_escapes(file)) return 0;
  return ::ioctl(file, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : kLeastWidth;
}

std::size_t text_width(int file) {
  const std::string_view columns = setting("COLUMNS");
  std::size_t width = 0;
  std::from_chars(columns.data(), columns.data() + columns.size(), width);
  return std::clamp(width == 0 ? terminal_columns(file) : width, kLeastWidth, kMostWidth);
}

std::string styled(std::string_view text, Style style, int file) {
  const std::string_view force = setting("CLICOLOR_FORCE");
  const bool is_forced = !force.empty() && force != "0";
  if (!setting("NO_COLOR").empty() || !(is_forced || takes_escapes(file))) return std::string(text);
  const char* const code = style == Style::kHeading ? "1" : style == Style::kError ? "1;31" : "1;33";
  return fmt::format("\x1b[{}m{}\x1b[0m", code, text);
}

}  // namespace isohf::cli
