#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common.h"
#include "isohf/error.h"

namespace isohf::cli {

/// What a program ends with after an error of that code.
[[nodiscard]] int exit_code_for(ErrorCode code);

/// Buffered writing to standard output, every failure noticed.
///
/// A reader that has gone away (a closed pipe) ends the program by SIGPIPE, without a message. Any other failure throws
/// Error{kIo}.
class StandardOutput {
 public:
  explicit StandardOutput(const Common& common) : file_(common.out) {}
  /// Text that may quote files: control characters but for ends of lines and tabs become blanks, as printable() has it.
  void write(std::string_view text);
  /// Text of the program's own, with escape codes.
  void write_styled(std::string_view text);
  /// Hands everything to the operating system: what comes after the last call is lost.
  void finish();

 private:
  int file_;
  std::string pending_;
};

/// Text that may come from a file, as one line without anything that a terminal obeys: control characters, those of
/// Unicode as well, become blanks.
[[nodiscard]] std::string printable(std::string text);

/// Thrown if standard output has no reader any more; run_main() ends by SIGPIPE.
struct OutputClosed {};

/// One line on standard error for each: "isohf convert: warning: ...". Throws Error{kWarning} if common.strict.
void print_warnings(const Common& common, const std::vector<Warning>& warnings);
void print_warning(const Common& common, const Warning& warning);
/// One line on standard error: "isohf convert: ...".
void print_note(const Common& common, const std::string& text);
void print_error_line(const Common& common, const Error& error);
/// The same, and with --json {"error": ...} on standard output. Returns `exit_code`.
int print_error(const Common& common, const Error& error, int exit_code);

/// Text of the library, with the options in place of the settings that it names between backticks.
[[nodiscard]] std::string spelled(std::string text);
/// Warnings of a document.
[[nodiscard]] nlohmann::ordered_json json_from(const std::vector<Warning>& warnings);
/// The member `error` of a document: code, exit_code, message, and of where, found, required and remedy what is known.
[[nodiscard]] nlohmann::ordered_json json_from(const Error& error, int exit_code);

}  // namespace isohf::cli
