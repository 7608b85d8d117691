#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace isohf::cli {

/// Standard input, line by line, without its line ends ("\n" or "\r\n"), or in records of a fixed length.
class LineReader {
 public:
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

  /// The next record of so many bytes, valid until the next call; empty at the end. Throws Error{kCorrupt} where the
  /// last one is cut short.
  template <typename BeforeWaiting>
  std::string_view next_record(std::size_t bytes, BeforeWaiting before_waiting) {
    while (buffer_.size() - from_ < bytes && !at_end_) {
      if (would_wait()) before_waiting();
      read_more();
    }
    return take_record(bytes);
  }

  /// Of the line or record that came last, from 1.
  [[nodiscard]] std::int64_t line_number() const { return line_number_; }

 private:
  std::optional<std::string> take_line();
  std::string_view take_record(std::size_t bytes);
  [[nodiscard]] static bool would_wait();
  void read_more();

  std::string buffer_;
  std::size_t from_ = 0;
  bool at_end_ = false;
  std::int64_t line_number_ = 0;
};

}  // namespace isohf::cli
