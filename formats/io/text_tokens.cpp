#include "formats/io/text_tokens.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <limits>

#include "formats/io/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::size_t kBufferBytes = std::size_t{1} << 18U;

/// What C libraries print for numbers that are none; the ones with # are of old Windows.
bool read_special(std::string_view word, double& value) {
  const bool negative = !word.empty() && word.front() == '-';
  if (!word.empty() && (word.front() == '-' || word.front() == '+')) word.remove_prefix(1);
  const std::string text = lower_case(word.substr(0, 16));
  const auto is_any = [&](std::initializer_list<std::string_view> spellings) {
    return std::find(spellings.begin(), spellings.end(), text) != spellings.end();
  };
  if (is_any({"nan", "nan(ind)", "nan(snan)", "1.#qnan", "1.#snan", "1.#ind", "1.#qnan0", "1.#ind00"})) {
    value = std::numeric_limits<double>::quiet_NaN();
    return true;
  }
  if (is_any({"inf", "infinity", "1.#inf", "1.#inf00"})) {
    value = negative ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
    return true;
  }
  return false;
}

/// Whether a number that no double holds is too small for one, not too large.
bool is_tiny(std::string_view number) {
  const std::size_t exponent = number.find_first_of("eE");
  if (exponent == std::string_view::npos) return number.find('.') < 300;
  return exponent < 60 && number[exponent + 1] == '-';
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
  if (kept > kLongestWord) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: line {}: there are more than {} bytes without a blank, which is no number",
                            file_.path(), line_, kLongestWord));
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
  std::string_view digits = word;
  if (!digits.empty() && digits.front() == '+') digits.remove_prefix(1);
  std::array<char, TextTokens::kLongestWord> with_point{};
  const std::size_t comma = digits.find(',');
  if (comma != std::string_view::npos) {
    if (digits.size() > with_point.size() || digits.find('.') != std::string_view::npos) return false;
    std::copy(digits.begin(), digits.end(), with_point.begin());
    with_point[comma] = '.';
    digits = {with_point.data(), digits.size()};
  }
  const std::size_t first = !digits.empty() && digits.front() == '-' ? 1 : 0;
  const bool numeric =
      digits.size() > first && (digits[first] == '.' || (digits[first] >= '0' && digits[first] <= '9'));
  if (numeric) {
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
    if (end == digits.data() + digits.size()) {
      if (error == std::errc::result_out_of_range && is_tiny(digits)) {
        value = 0.0;
        return true;
      }
      return error == std::errc{};
    }
  }
  return read_special(word, value);
}

}  // namespace isohf
