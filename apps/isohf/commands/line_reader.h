#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace isohf::cli {

/// Standard input, line by line, without its line ends ("\n" or "\r\n").
class LineReader {
 public:
  /// file  a descriptor
  explicit LineReader(int file) : file_(file) {}

  /// The next line; nullopt at the end. Calls `before_waiting` where the operating system has nothing more yet, so that
  /// a program at the other end of a pipe sees the answers to all that it has sent. Throws Error{kIo}, and
  /// Error{kCorrupt} for lines that are absurdly long.
  template <typename BeforeWaiting>
  std::optional<std::string> next(BeforeWaiting before_waiting) {
    while (true) {
      if (std::optional<std::string> line = take_line()) return line;
      if (at_end_) return std::nullopt;
      if (would_wait()) before_waiting();
      read_more();
    }
  }

  /// Of the line that came last, from 1.
  [[nodiscard]] std::int64_t line_number() const { return line_number_; }

 private:
  std::optional<std::string> take_line();
  [[nodiscard]] bool would_wait() const;
  void read_more();

  int file_;
  std::string buffer_;
  std::size_t from_ = 0;
  bool at_end_ = false;
  std::int64_t line_number_ = 0;
};

}  // namespace isohf::cli
