#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace isohf::test {

/// How a program is run.
struct RunOptions {
  std::string input;                                   ///< its standard input
  std::string folder;                                  ///< its working directory; empty: ours
  std::string output_path;                             ///< standard output goes to this file instead of a pipe
  bool close_output = false;                           ///< nobody reads standard output: a closed pipe
  std::optional<std::uint64_t> file_size_limit_bytes;  ///< RLIMIT_FSIZE: a disk that fills up
  std::optional<std::uint64_t> address_space_bytes;    ///< RLIMIT_AS: memory that runs out
  std::optional<std::uint64_t> open_files;             ///< RLIMIT_NOFILE
  bool without_privileges = false;                     ///< as the user nobody, where the test runs as root
};

/// What a program did.
struct RunResult {
  int exit_code = -1;  ///< 128 + signal where a signal ended it
  std::string out;
  std::string err;
};

/// A program that runs beside the test. Killed where it is forgotten.
class RunningProgram {
 public:
  explicit RunningProgram(const std::vector<std::string>& command, const RunOptions& options = {});
  ~RunningProgram();
  RunningProgram(const RunningProgram&) = delete;
  RunningProgram& operator=(const RunningProgram&) = delete;

  void send(int signal) const;
  /// Reads on until standard error holds `text`; false where the program ends first.
  bool wait_for_error_text(const std::string& text);
  /// Reads to the end and collects the program.
  RunResult wait();

 private:
  bool read_some();
  void feed_input();

  pid_t pid_ = -1;
  int in_ = -1;
  int out_ = -1;
  int err_ = -1;
  std::string unsent_input_;
  RunResult result_;
};

/// The words of a command, and more after them.
inline std::vector<std::string> with_more(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

/// Runs a program to its end.
RunResult run_program(const std::vector<std::string>& command, const RunOptions& options = {});

/// Runs a command of isohf: in this process, unless it is `view` or the options limit or close what only a process of its
/// own has (run_isohf.cpp, with isohf_commands).
RunResult run_isohf(const std::vector<std::string>& arguments, const RunOptions& options = {});
/// The isohf of this build.
std::string isohf_path();

}  // namespace isohf::test
