#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "formats/io/raw_file.h"
#include "isohf/raster.h"

namespace isohf {

/// A text without UTF-8's byte order mark, which spreadsheets and PowerShell write.
[[nodiscard]] inline std::string_view without_byte_order_mark(std::string_view text) {
  return text.starts_with("\xEF\xBB\xBF") ? text.substr(3) : text;
}

/// Reads a text file by words, whatever blanks and line ends are between them, or by lines; holds 256 KiB.
class TextTokens {
 public:
  /// `file` must outlive this.
  explicit TextTokens(const RawFile& file);

  /// Goes to a place in the file that is not inside a word; lines count from 1 there.
  void seek(std::uint64_t offset_bytes);

  /// The next word, valid until the next call; false at the end of the file.
  /// Throws Error: kIo; kCorrupt for a word of more than kLongest bytes.
  bool next(std::string_view& word) {
    for (;;) {
      while (is_blank(*at_)) line_ += *at_++ == '\n' ? 1U : 0U;
      const char* begin = at_;
      while (!is_blank(*at_) && *at_ != '\0') ++at_;
      if (at_ != end_ && *at_ != '\0') {
        word = {begin, static_cast<std::size_t>(at_ - begin)};
        return true;
      }
      if (at_ != end_) {  // a zero byte in the file is part of a word
        if (finish_odd_word(begin, word)) return true;
      } else if (!fill(begin)) {
        word = {at_, static_cast<std::size_t>(end_ - at_)};
        at_ = end_;
        return !word.empty();
      }
    }
  }

  /// The next line without its end; as next().
  bool next_line(std::string_view& line) {
    const void* end = nullptr;
    do {
      end = std::memchr(at_, '\n', static_cast<std::size_t>(end_ - at_));
    } while (end == nullptr && fill(at_));
    const char* const stop = end == nullptr ? end_ : static_cast<const char*>(end);
    line = {at_, static_cast<std::size_t>(stop - at_)};
    line_ += end != nullptr ? 1U : 0U;
    at_ = std::min(stop + 1, end_);
    return end != nullptr || !line.empty();
  }

  /// Of the last word.
  [[nodiscard]] std::uint64_t line() const { return line_; }
  [[nodiscard]] std::uint64_t offset_of(std::string_view word) const {
    return base_ + static_cast<std::uint64_t>(word.data() - buffer_.data());
  }

  static constexpr std::size_t kLongest = 4096;

 private:
  static bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
  bool finish_odd_word(const char* begin, std::string_view& word);
  /// Reads on, keeping what begins at `keep`, which at_ then points to; false where the file has no more.
  bool fill(const char* keep);

  const RawFile& file_;
  std::vector<char> buffer_;  // ends in a zero byte beyond end_
  const char* at_ = nullptr;
  const char* end_ = nullptr;
  std::uint64_t base_ = 0;  // place of the buffer in the file
  std::uint64_t line_ = 1;
};

/// Reads the number that a word of a text is, with a decimal point or one decimal comma, an exponent behind E or Fortran's
/// D, or one of the spellings of NaN and infinity that programs print. False for any other word and for numbers beyond
/// the range of a double.
[[nodiscard]] bool read_decimal(std::string_view word, double& value);

/// Reads a number without an exponent that is whole and fits 32 bits: "12", "+12.", "12,0", not "12,", part of a list.
[[nodiscard]] inline bool read_whole(std::string_view word, std::int32_t& value) {
  const char* const end = word.data() + word.size();
  const auto [at, error] = std::from_chars(word.data() + (word.starts_with('+') ? 1 : 0), end, value);
  if (error != std::errc{}) return false;
  const std::string_view rest(at, end);
  if (rest.empty() || rest == ".") return true;
  return rest.size() > 1 && (rest[0] == '.' || rest[0] == ',') && rest.find_first_not_of('0', 1) == rest.npos;
}

/// The rows of numbers in a text: where each begins, or every second, fourth, ... once there are many (512 KiB at
/// most), and reading on from there.
class TextRows {
 public:
  /// `words` must outlive this. columns  numbers of a row
  TextRows(TextTokens& words, std::int64_t columns) : words_(&words), columns_(columns) {}

  /// Takes rows in their order, from 0.
  void note(std::int64_t row, std::uint64_t offset_bytes) {
    if (row % stride_ != 0) return;
    if (offsets_.size() == kMost) {
      for (std::size_t i = 0; i < kMost / 2; ++i) offsets_[i] = offsets_[2 * i];
      offsets_.resize(kMost / 2);
      stride_ *= 2;
      if (row % stride_ != 0) return;
    }
    offsets_.push_back(offset_bytes);
  }

  /// Reads `window`, whose rows have been noted, into samples of T by `read_number(word, T&)`. Goes on where it stopped
  /// last where that is nearer than a noted row. False where the text is no longer what it was.
  template <typename T, typename Read>
  [[nodiscard]] bool read(const Window& window, std::span<std::byte> samples, Read read_number) {
    std::byte* out = samples.data();
    std::string_view word;
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
      const std::int64_t wanted = row * columns_ + window.column;
      const std::int64_t noted = row / stride_ * stride_ * columns_;
      if (next_ < noted || next_ > wanted) {
        words_->seek(offsets_[static_cast<std::size_t>(row / stride_)]);
        next_ = noted;
      }
      for (const std::int64_t end = wanted + window.columns; next_ < end; ++next_) {
        T value{};
        if (!words_->next(word) || (next_ >= wanted && !read_number(word, value))) {
          next_ = kNowhere;
          return false;
        }
        if (next_ < wanted) continue;
        std::memcpy(out, &value, sizeof(T));
        out += sizeof(T);
      }
    }
    return true;
  }

 private:
  static constexpr std::size_t kMost = 65536;
  static constexpr std::int64_t kNowhere = std::numeric_limits<std::int64_t>::max();

  TextTokens* words_;
  std::int64_t columns_;
  std::vector<std::uint64_t> offsets_;
  std::int64_t stride_ = 1;
  std::int64_t next_ = kNowhere;  ///< the number that words_ reads next, counted by rows
};

}  // namespace isohf
