#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace isohf {

/// Names and keywords compare without regard to case by either of these. ASCII letters alone: what formats define has
/// no others, and no locale changes the answer.
[[nodiscard]] inline std::string lower_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return result;
}
[[nodiscard]] inline std::string upper_case(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return result;
}

/// A text without the blanks, line ends and zero bytes around it.
[[nodiscard]] inline std::string trimmed(std::string_view text) {
  constexpr std::string_view kBlanks(" \t\r\n\f\v\0", 7);
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  return std::string(text.substr(0, text.find_last_not_of(kBlanks) + 1));
}

/// Bytes of a file as the characters that they may be.
[[nodiscard]] inline std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

/// A word fit for a message: at most 40 bytes, only printable ones.
[[nodiscard]] inline std::string printable(std::string_view word) {
  std::string text(word.substr(0, 40));
  for (char& c : text) c = c >= ' ' && c <= '~' ? c : '?';
  return word.size() > 40 ? text + "..." : text;
}

/// A text found in a file, fit for one line: blanks for control characters.
[[nodiscard]] inline std::string one_line(std::string text) {
  for (char& c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7F) c = ' ';
  }
  return text;
}

}  // namespace isohf
