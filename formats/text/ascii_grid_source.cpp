#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "formats/georeference/sidecars.h"
#include "formats/grids/grid_header.h"
#include "formats/io/bands.h"
#include "formats/io/file_source.h"
#include "formats/io/raw_file.h"
#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// Plain names, as GridHeader has them.
constexpr std::array<std::string_view, 10> kKnownWords = {"ncols",     "nrows",  "xllcorner", "yllcorner", "xllcenter",
                                                          "yllcenter", "nodata", "cellsize",  "dx",        "dy"};

bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

class AsciiGridSource final : public FileSource {
 public:
  AsciiGridSource(const std::string& path, const OpenOptions& options)
      : FileSource(path, "ESRI ASCII grid"), words_(*file_) {
    (void)choose_band(info_, options, 1);
    GridHeader header(path);
    std::string_view word;
    const bool any = read_header(header, word);
    header.require_only(kKnownWords);
    header.read_size(info_);
    header.read_place(info_);
    is_marked_ = header.has("nodata") || !options.void_values.empty();
    require_room();
    scan(word, any);
    header.read_nodata(info_);
    read_sidecars(info_, 1);
    if (info_.void_values.empty() && !marker_.empty()) {
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
  [[noreturn]] void refuse(const std::string& what) const {
    fail(ErrorCode::kCorrupt, fmt::format("line {}: {}", words_.line(), what));
  }

  /// Leaves the first word of the numbers in `word`; false if there is none.
  bool read_header(GridHeader& header, std::string_view& word) {
    const std::string begin = first_bytes(*file_, 3);
    words_.seek(begin.size() - without_byte_order_mark(begin).size());
    while (words_.next(word)) {
      double special = 0.0;
      if (std::isalpha(static_cast<unsigned char>(word.front())) == 0 || read_decimal(word, special)) return true;
      const std::string name(word);
      const std::uint64_t line = words_.line();
      if (!words_.next(word)) refuse(fmt::format("{} has no value", printable(name)));
      header.add(name, word, line);
    }
    return false;
  }

  /// A number takes a byte and another one keeps it apart from the next.
  void require_room() const {
    const auto most = static_cast<std::int64_t>((file_->size_bytes() + 1) / 2);
    if (info_.width <= most && info_.height <= most / info_.width) return;
    fail(ErrorCode::kCorrupt, fmt::format("the header says {} x {} numbers; the file's {} bytes hold {} at most",
                                          info_.width, info_.height, file_->size_bytes(), most));
  }

  /// Checks every number, finds the sample type and notes where rows begin.
  void scan(std::string_view word, bool any) {
    rows_.emplace(words_, info_.width);
    bool are_whole = true;
    for (std::int64_t row = 0; row < info_.height; ++row) {
      for (std::int64_t column = 0; column < info_.width; ++column) {
        if (!any) {
          refuse(fmt::format("the file ends after {} of {} x {} numbers", row * info_.width + column, info_.width,
                             info_.height));
        }
        if (column == 0) rows_->note(row, words_.offset_of(word));
        are_whole = check(word) && are_whole;
        any = words_.next(word);
      }
    }
    if (any) {
      refuse(fmt::format("\"{}\" comes after the {} x {} numbers that the header says", printable(word), info_.width,
                         info_.height));
    }
    info_.sample_type = are_whole ? SampleType::kInt32 : SampleType::kFloat64;
    if (decimal_ == ',') {
      info_.warnings.emplace_back("the numbers have decimal commas: 1,5 is read as one and a half");
    }
  }

  /// Whether a number can be an int32 sample. Computes no value if it has few digits and a decimal sign alone.
  bool check(std::string_view word) {
    const char* at = word.data();
    const char* const end = at + word.size();
    if (*at == '-' || *at == '+') ++at;
    const char* const digits = at;
    while (at != end && is_digit(*at)) ++at;
    const bool is_short = at != digits && at - digits <= 9;
    bool is_whole = is_short;
    char sign = 0;
    if (end - at > 1 && (*at == '.' || *at == ',')) {
      for (sign = *at++; at != end && is_digit(*at); ++at) is_whole = is_whole && *at == '0';
    }
    if (at != end || !is_short) is_whole = check_slowly(word, sign);
    if (sign != 0 && sign != decimal_) note_sign(word, sign);
    if (!is_marked_ && word.size() > 4 && word[0] == '-' && (word[1] == '9' || word[1] == '3')) note_marker(word);
    return is_whole;
  }

  /// The same for any number; finds its decimal sign.
  bool check_slowly(std::string_view word, char& sign) const {
    std::int32_t whole = 0;
    double value = 0.0;
    const bool is_whole = read_whole(word, whole);
    if (!is_whole && !read_decimal(word, value)) {
      const bool is_list = std::ranges::count(word, ',') > 1 || word.ends_with(',');
      refuse(fmt::format("\"{}\" is not a number{}", printable(word),
                         is_list ? "; numbers must have blanks between them, not commas" : ""));
    }
    const std::size_t at = word.find_first_of(".,");
    sign = at == word.npos ? '\0' : word[at];
    return is_whole;
  }

  void note_sign(std::string_view word, char sign) {
    if (decimal_ != 0) {
      refuse(fmt::format("\"{}\" has a decimal {}, numbers before it have the other sign; they must all have the same",
                         printable(word), sign == ',' ? "comma" : "point"));
    }
    decimal_ = sign;
  }

  /// Remembers the value that means nodata by custom.
  void note_marker(std::string_view word) {
    double value = 0.0;
    if (!marker_.empty() || !read_decimal(word, value) || (value != -9999.0 && value != -32768.0)) return;
    marker_ = fmt::format("{}", value);
  }

  TextTokens words_;
  std::optional<TextRows> rows_;
  char decimal_ = 0;        ///< '.', ',', or 0 as long as no number has one
  bool is_marked_ = false;  ///< a nodata value is named
  std::string marker_;      ///< nodata by custom, found in the file
};

bool looks_like_ascii_grid(std::span<const std::byte> head) {
  constexpr std::string_view kBlanks = " \t\r\n\f\v";
  std::string_view text = without_byte_order_mark(text_of(head));
  text.remove_prefix(std::min(text.find_first_not_of(kBlanks), text.size()));
  const std::string name = GridHeader::plain_name(text.substr(0, text.find_first_of(kBlanks)));
  return name.size() < text.size() && std::ranges::find(kKnownWords, name) != kKnownWords.end();
}

std::unique_ptr<HeightSource> open_ascii_grid(const std::string& path, const OpenOptions& options) {
  // The header of a binary grid begins with the same words.
  if (lower_case(path).ends_with(".hdr")) return kHeaderGridFormat.open(path, options);
  return std::make_unique<AsciiGridSource>(path, options);
}

}  // namespace

const Format kAsciiGridFormat = {
    .name = "ESRI ASCII grid", .extensions = {".asc"}, .open = open_ascii_grid, .recognises = looks_like_ascii_grid};

}  // namespace isohf
