#pragma once

#include <string>
#include <string_view>

namespace isohf::cli {

/// Buffered writing to standard output, every failure noticed.
///
/// A reader that has gone away (a closed pipe) is no error worth a message: it ends the program with exit code 1 and
/// nothing said. Any other failure throws Error{kIo}.
class StandardOutput {
 public:
  void write(std::string_view text);
  /// Hands everything to the operating system.
  void flush();
  /// flush(), named for the end: output that was not finished is lost.
  void finish() { flush(); }

 private:
  std::string pending_;
};

/// Text that may come from a file, as one line without anything that a terminal obeys: control characters, those of
/// Unicode as well, become blanks.
[[nodiscard]] std::string printable(std::string text);

/// Thrown where standard output's reader has gone; main() ends quietly.
struct OutputClosed {};

/// One line on standard error: "PROGRAM: warning: ...".
void print_warning(const std::string& text);
/// One line on standard error: "PROGRAM: ...".
void print_error(const std::string& text);
/// One line on standard error as it stands.
void print_note(const std::string& text);

}  // namespace isohf::cli
