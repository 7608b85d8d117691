#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/error.h"

namespace isohf::cli {

/// How the programs end (docs/cli.md).
enum ExitCode : int {
  kExitDone = 0,
  kExitFailed = 1,
  kExitUsage = 2,
  kExitDifferences = 3,  ///< verify or diff found some
  kExitInterrupted = 130,
  kExitOutputClosed = 141,  ///< as a shell reports SIGPIPE
};

/// What a program ends with after an error of that code.
[[nodiscard]] int exit_code_for(ErrorCode code);

/// How messages and help call the program; run_program() sets it.
[[nodiscard]] std::string& program_name();

/// Buffered writing to standard output, every failure noticed.
///
/// A reader that has gone away (a closed pipe) ends the program by SIGPIPE, without a message. Any other failure throws
/// Error{kIo}.
class StandardOutput {
 public:
  /// Text that may quote files: control characters but for ends of lines and tabs become blanks, as printable() has it.
  void write(std::string_view text);
  /// Text of the program's own, with escape codes.
  void write_styled(std::string_view text);
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

/// Thrown where standard output's reader has gone; run_program() ends by SIGPIPE.
struct OutputClosed {};

/// How this run tells of warnings and errors; one for the process, as its streams are. The options set it.
struct Telling {
  bool json = false;        ///< --json: an error is a document on standard output as well
  bool json_notes = false;  ///< --progress json: every line on standard error is a JSON object
  bool quiet = false;       ///< -q: of warnings only those of kind kLoss
  bool strict = false;      ///< --strict: a warning is an error
};
[[nodiscard]] Telling& telling();

/// One line on standard error for each: "PROGRAM: warning: ...". Throws Error{kWarning} where strict.
void print_warnings(const std::vector<Warning>& warnings);
void print_warning(const Warning& warning);
/// One line on standard error: "PROGRAM: ...".
void print_error_line(const Error& error);
/// The same, and with --json {"error": ...} on standard output. Returns `exit_code`.
int print_error(const Error& error, int exit_code);
/// The same for what is a fault of the program's own.
int print_internal_error(const std::string& what);
/// The member `error` of such a document: code, exit_code, message, and of where, found, required and remedy what is
/// known.
[[nodiscard]] nlohmann::ordered_json json_from(const Error& error, int exit_code);
/// One line on standard error: "PROGRAM: ...".
void print_note(const std::string& text);
/// One line on standard error as it stands.
void print_progress(const std::string& line);

}  // namespace isohf::cli
