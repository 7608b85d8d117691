#include "formats/io/text_tokens.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <limits>
#include <optional>

#include "isohf/base/text/number_text.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18U;

/// What old Windows prints for numbers that are none; from_chars reads the other spellings.
bool read_special(std::string_view word, double& value) {
  const bool is_negative = word.starts_with('-');
  if (is_negative || word.starts_with('+')) word.remove_prefix(1);
  std::string text = lower_case(word.substr(0, 16));
  if (text.starts_with("1,")) text[1] = '.';
  constexpr std::array<std::string_view, 5> kNan = {"1.#qnan", "1.#snan", "1.#ind", "1.#qnan0", "1.#ind00"};
  const bool is_infinite = text == "1.#inf" || text == "1.#inf00";
  if (!is_infinite && std::ranges::find(kNan, text) == kNan.end()) return false;
  value = is_infinite ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
  if (is_negative) value = -value;
  return true;
}

/// Whether a number with a point that no double holds is too small for one, not too large.
bool is_tiny(std::string_view number) {
  const std::size_t exponent = number.find_first_of("eE");
  if (exponent == std::string_view::npos) return number.find('.') < 300;
  return exponent < 60 && number[exponent + 1] == '-';
}

/// A number with a decimal comma or Fortran's exponent (1.0D+03), or one that is too small for a double.
bool read_odd_number(std::string_view word, double& value) {
  std::array<char, 512> text;  // NOLINT(cppcoreguidelines-pro-type-member-init): costs time
  if (word.size() > text.size() || std::ranges::count(word, ',') > 1 || word.ends_with(',')) return false;
  if (word.find(',') != word.npos && word.find('.') != word.npos) return false;
  std::ranges::transform(word, text.begin(), [](char c) { return c == ',' ? '.' : c == 'D' || c == 'd' ? 'E' : c; });
  const char* const begin = text.data() + (word.starts_with('+') ? 1 : 0);
  const char* const end = text.data() + word.size();
  const auto [at, error] = std::from_chars(begin, end, value);
  if (at != end || error == std::errc::invalid_argument) return false;
  if (error == std::errc{}) return true;
  value = 0.0;
  return is_tiny({begin, end});
}

}  // namespace

TextTokens::TextTokens(const RawFile& file) : file_(file), buffer_(kBufferBytes + 1) {
  seek(0);
}

void TextTokens::seek(std::uint64_t offset_bytes) {
  base_ = offset_bytes;
  at_ = end_ = buffer_.data();
  buffer_[0] = '\0';
  line_ = 1;
}

bool TextTokens::finish_odd_word(const char* begin, std::string_view& word) {
  while (at_ != end_ && !is_blank(*at_)) ++at_;
  if (at_ == end_) {
    if (fill(begin)) return false;
    begin = buffer_.data();  // whither the word has moved
    at_ = end_;
  }
  word = {begin, static_cast<std::size_t>(at_ - begin)};
  return true;
}

bool TextTokens::fill(const char* keep) {
  const auto kept = static_cast<std::size_t>(end_ - keep);
  if (kept > kLongest) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: line {}: there are more than {} bytes without a blank or line end", file_.path(),
                            line_, kLongest));
  }
  const std::uint64_t offset = base_ + static_cast<std::uint64_t>(end_ - buffer_.data());
  base_ = offset - kept;
  std::memmove(buffer_.data(), keep, kept);
  const std::size_t got =
      file_.read_some(offset, std::as_writable_bytes(std::span(buffer_)).subspan(kept, kBufferBytes - kept));
  at_ = buffer_.data();
  end_ = buffer_.data() + kept + got;
  buffer_[kept + got] = '\0';
  return got > 0;
}

bool read_decimal(std::string_view word, double& value) {
  const auto number = word.find(',') == word.npos ? number_from(word) : std::nullopt;
  if (number) value = *number;
  return number || read_odd_number(word, value) || read_special(word, value);
}

}  // namespace isohf
