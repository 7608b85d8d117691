#include "formats/readers.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/grids/grid_header.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/io/text.h"
#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

const std::vector<std::string_view>& known_words() {
  static const std::vector<std::string_view> words = {
      "ncols", "ncol",      "nrows",       "nrow",   "xllcorner", "yllcorner", "xllcenter", "xllcentre", "yllcenter",
      "dx",    "yllcentre", "nodatavalue", "nodata", "cellsize",  "dy",        "xcellsize", "ycellsize"};
  return words;
}

/// The first word of a text, a byte order mark passed over; empty where it does not end within `text`.
std::string_view first_word(std::string_view text) {
  if (text.substr(0, 3) == "\xEF\xBB\xBF") text.remove_prefix(3);
  constexpr std::string_view kBlanks = " \t\r\n\f\v";
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  const std::size_t end = text.find_first_of(kBlanks);
  return end == std::string_view::npos ? std::string_view() : text.substr(0, end);
}

/// What a word among the numbers is, found without computing its value.
struct Shape {
  bool number = false;
  bool whole = false;      ///< no exponent, and nothing but zeros behind the decimal sign
  char decimal = 0;        ///< '.', ',' or none
  std::size_t digits = 0;  ///< before the decimal sign
};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

Shape shape_of(std::string_view word) {
  const char* at = word.data();
  const char* const end = at + word.size();
  if (at != end && (*at == '-' || *at == '+')) ++at;
  const char* const first = at;
  while (at != end && is_digit(*at)) ++at;
  Shape shape;
  shape.digits = static_cast<std::size_t>(at - first);
  shape.whole = shape.digits > 0;
  std::size_t fraction = 0;
  if (at != end && (*at == '.' || *at == ',')) {
    shape.decimal = *at++;
    for (; at != end && is_digit(*at); ++at, ++fraction) shape.whole = shape.whole && *at == '0';
    if (shape.decimal == ',' && fraction == 0) return {};  // "1, 2, 3": a list
  }
  if (shape.digits + fraction > 0 && at != end && (*at == 'e' || *at == 'E')) {
    shape.whole = false;
    ++at;
    if (at != end && (*at == '-' || *at == '+')) ++at;
    const char* const exponent = at;
    while (at != end && is_digit(*at)) ++at;
    double value = 0.0;
    shape.number = at == end && at != exponent && read_decimal(word, value);
    return shape;
  }
  shape.number = at == end && shape.digits + fraction > 0;
  if (shape.number && shape.digits > 300) {
    double value = 0.0;
    shape.number = read_decimal(word, value);
  }
  if (!shape.number) {
    double special = 0.0;
    shape = {};
    shape.number = read_decimal(word, special) && !std::isfinite(special);
  }
  return shape;
}

/// The value of a word whose shape is whole; false beyond 32 bits.
bool read_whole(std::string_view word, std::int32_t& value) {
  const bool negative = word.front() == '-';
  std::int64_t sum = 0;
  std::size_t i = negative || word.front() == '+' ? 1 : 0;
  if (i == word.size() || !is_digit(word[i])) return false;
  for (; i < word.size() && is_digit(word[i]); ++i) {
    sum = sum * 10 + (word[i] - '0');
    if (sum > std::int64_t{1} << 31U) return false;
  }
  if (negative) sum = -sum;
  if (sum > std::numeric_limits<std::int32_t>::max()) return false;
  value = static_cast<std::int32_t>(sum);
  return true;
}

class AsciiGridSource final : public FileSource {
 public:
  AsciiGridSource(const std::string& path, const OpenOptions& options)
      : FileSource(path, "ESRI ASCII grid", options), words_(*file_) {
    (void)choose_band(info_, options, 1);
    GridHeader header(path);
    std::string_view word;
    const bool any = read_header(header, word);
    header.require_only(known_words());
    header.read_size(info_);
    header.read_place(info_);
    marked_ = header.has("nodatavalue") || header.has("nodata") || !options.void_values.empty();
    require_room();
    scan(word, any);
    header.read_void(info_);
    read_files_beside(info_, 1);
    if (!marked_ && info_.void_values.empty() && !marker_.empty()) {
      info_.warnings.emplace_back(
          fmt::format("the header names no void value, but {} occurs; if it means a void, give `void_values` {}",
                      marker_, marker_),
          Warning::Kind::kUndeclaredNodata);
    }
    info_.block_width = info_.width;
    apply_open_options(info_, options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    const bool done = info_.sample_type == SampleType::kInt32 ? rows_->read<std::int32_t>(window, samples, read_whole)
                                                              : rows_->read<double>(window, samples, read_decimal);
    if (!done) fail(ErrorCode::kCorrupt, "the file has changed since it was opened");
  }

 private:
  [[noreturn]] void refuse(ErrorCode code, const std::string& what) const {
    throw Error(code, fmt::format("{}: line {}: {}", info_.path, words_.line(), what));
  }

  /// Leaves the first word of the numbers in `word`; false where there is none.
  bool read_header(GridHeader& header, std::string_view& word) {
    std::array<char, 3> mark{};
    if (file_->read_some(0, std::as_writable_bytes(std::span(mark))) == 3 &&
        std::string_view(mark.data(), 3) == "\xEF\xBB\xBF") {
      words_.seek(3);
    }
    while (words_.next(word)) {
      double special = 0.0;
      if (std::isalpha(static_cast<unsigned char>(word.front())) == 0 || read_decimal(word, special)) return true;
      const std::string name(word);
      const std::uint64_t line = words_.line();
      if (!words_.next(word)) refuse(ErrorCode::kCorrupt, fmt::format("{} has no value", printable(name)));
      header.add(name, word, line);
    }
    return false;
  }

  /// A number takes a byte and another one keeps it apart from the next.
  void require_room() const {
    const auto most = static_cast<std::int64_t>((file_->size_bytes() + 1) / 2);
    if (info_.width > most || info_.height > most / info_.width) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: the header says {} x {} numbers; the file's {} bytes hold {} at most", info_.path,
                              info_.width, info_.height, file_->size_bytes(), most));
    }
  }

  /// Checks every number, learns the sample type and notes where rows begin.
  void scan(std::string_view word, bool any) {
    rows_.emplace(words_, info_.width);
    bool whole = true;
    for (std::int64_t row = 0; row < info_.height; ++row) {
      for (std::int64_t column = 0; column < info_.width; ++column) {
        if (!any) refuse_short(row, column);
        if (column == 0) rows_->note(row, words_.offset_of(word));
        whole = check(word) && whole;
        any = words_.next(word);
      }
    }
    if (any) {
      refuse(ErrorCode::kCorrupt, fmt::format("\"{}\" comes after the {} x {} numbers that the header says",
                                              printable(word), info_.width, info_.height));
    }
    info_.sample_type = whole ? SampleType::kInt32 : SampleType::kFloat64;
    if (decimal_ == ',') {
      info_.warnings.emplace_back("the numbers have decimal commas: 1,5 is read as one and a half");
    }
  }

  [[noreturn]] void refuse_short(std::int64_t row, std::int64_t column) const {
    refuse(ErrorCode::kCorrupt, fmt::format("the file ends after {} of {} x {} numbers", row * info_.width + column,
                                            info_.width, info_.height));
  }

  /// Whether a number can be an int32 sample.
  bool check(std::string_view word) {
    const Shape shape = shape_of(word);
    if (!shape.number) refuse_word(word);
    if (shape.decimal != 0 && shape.decimal != decimal_) {
      if (decimal_ != 0) {
        refuse(ErrorCode::kCorrupt, fmt::format("\"{}\" has a decimal {}, numbers before it have the other sign; they "
                                                "must all have the same",
                                                printable(word), shape.decimal == ',' ? "comma" : "point"));
      }
      decimal_ = shape.decimal;
    }
    if (!marked_ && word.size() > 4 && word.front() == '-' && marker_.empty()) note_marker(word, shape);
    std::int32_t value = 0;
    return shape.whole && (shape.digits <= 9 || read_whole(word, value));
  }

  [[noreturn]] void refuse_word(std::string_view word) const {
    const char* why = std::count(word.begin(), word.end(), ',') > 1 || word.back() == ','
                          ? "; numbers must have blanks between them, not commas"
                          : "";
    refuse(ErrorCode::kCorrupt, fmt::format("\"{}\" is not a number{}", printable(word), why));
  }

  /// Remembers the value that means a void by custom.
  void note_marker(std::string_view word, const Shape& shape) {
    if ((word[1] != '9' && word[1] != '3') || shape.digits > 5) return;
    double value = 0.0;
    if (read_decimal(word, value) && (value == -9999.0 || value == -32768.0))
      marker_ = value < -9999.0 ? "-32768" : "-9999";
  }

  TextTokens words_;
  std::optional<TextRows> rows_;
  char decimal_ = 0;
  bool marked_ = false;  // a void value is named
  std::string marker_;   // void by custom, seen in the file
};

}  // namespace

bool looks_like_ascii_grid(std::span<const std::byte> head) {
  const std::string name = GridHeader::plain_name(first_word(text_of(head)));
  return std::find(known_words().begin(), known_words().end(), name) != known_words().end();
}

std::unique_ptr<HeightSource> open_ascii_grid(const std::string& path, const OpenOptions& options) {
  // The header of a binary grid begins with the same words.
  if (lower_case(path).ends_with(".hdr")) return open_header_grid(path, options);
  return std::make_unique<AsciiGridSource>(path, options);
}

}  // namespace isohf
