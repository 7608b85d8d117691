#include "formats/readers.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "formats/binary_grids/grid_header.h"
#include "formats/files/bands.h"
#include "formats/files/file_source.h"
#include "formats/files/text.h"
#include "formats/files/text_tokens.h"
#include "formats/georeference/files_beside.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The header of a GRASS ASCII raster (GRASS, r.in.ascii): "north: 4928000", edges of the region, rows:, cols: and,
/// where they are, null:, type: (int, float, double) and multiplier:. Edges may be degrees as in 45:30:00N.
class GrassHeader {
 public:
  /// `path` is for messages.
  explicit GrassHeader(std::string path) : path_(std::move(path)) {}

  /// Whether `word` is the name of a header line, with its colon, perhaps with a value right behind it.
  [[nodiscard]] static bool is_name(std::string_view word);

  /// Takes one line: `name` as is_name has it, without the colon. Throws Error{kCorrupt} where it was given before.
  void add(std::string_view name, std::string_view value, std::uint64_t line);

  /// Size, place, scale and void value into info; the void value is raw, before the multiplier. Throws Error{kCorrupt}.
  void read(SourceInfo& info) const;
  [[nodiscard]] bool is_whole() const;  ///< type: int
  [[nodiscard]] bool has_null() const { return !values_[kNull].text.empty(); }
  /// The raw value of null:; NaN where it is none or no number (then it is a word among the numbers).
  [[nodiscard]] double null_value() const;
  /// The word that means a void; "*" where the header names none.
  [[nodiscard]] std::string_view null_word() const;

 private:
  enum Name : std::size_t { kNorth, kSouth, kEast, kWest, kRows, kCols, kNull, kType, kMultiplier, kNames };
  struct Value {
    std::string text;
    std::uint64_t line = 0;
  };
  [[noreturn]] void refuse(Name name, std::string_view required) const;
  [[nodiscard]] std::int64_t count(Name name) const;
  [[nodiscard]] double edge(Name name, bool& degrees) const;
  static std::size_t find(std::string_view name);

  std::string path_;
  std::array<Value, kNames> values_;
};

constexpr std::array<std::string_view, 9> kNameTexts = {"north", "south", "east", "west",      "rows",
                                                        "cols",  "null",  "type", "multiplier"};

/// "45:30:00.5N" in degrees, South and West negative; false where the text is none.
bool read_degrees(std::string_view text, double& degrees) {
  double sign = 1.0;
  if (!text.empty() && std::string_view("nsewNSEW").find(text.back()) != std::string_view::npos) {
    if (std::string_view("swSW").find(text.back()) != std::string_view::npos) sign = -1.0;
    text.remove_suffix(1);
  }
  if (!text.empty() && text.front() == '-') {
    sign = -sign;
    text.remove_prefix(1);
  }
  double unit = 1.0;
  degrees = 0.0;
  for (int part = 0; part < 3; ++part, unit /= 60.0) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    const std::string_view number = text.substr(0, colon);
    double value = 0.0;
    if (!read_decimal(number, value) || !(value >= 0.0) || (part > 0 && value >= 60.0)) return false;
    degrees += value * unit;
    if (colon == text.size()) {
      degrees *= sign;
      return std::isfinite(degrees);
    }
    text.remove_prefix(colon + 1);
  }
  return false;
}

std::size_t GrassHeader::find(std::string_view name) {
  const std::string plain = lower_case(name);
  return static_cast<std::size_t>(std::find(kNameTexts.begin(), kNameTexts.end(), plain) - kNameTexts.begin());
}

bool GrassHeader::is_name(std::string_view word) {
  const std::size_t colon = word.find(':');
  return colon != std::string_view::npos && find(word.substr(0, colon)) < kNames;
}

void GrassHeader::add(std::string_view name, std::string_view value, std::uint64_t line) {
  Value& known = values_[find(name)];
  if (!known.text.empty()) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: line {}: {}: is given again, line {} has it; it must be given once", path_, line,
                            printable(name), known.line));
  }
  known = {std::string(value), line};
}

void GrassHeader::refuse(Name name, std::string_view required) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {}: is \"{}\", must be {}", path_, values_[name].line,
                                               kNameTexts[name], printable(values_[name].text), required));
}

std::int64_t GrassHeader::count(Name name) const {
  const std::string& text = values_[name].text;
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < 1) refuse(name, "a whole number from 1 on");
  return value;
}

double GrassHeader::edge(Name name, bool& degrees) const {
  const std::string& text = values_[name].text;
  double value = 0.0;
  if (read_decimal(text, value) && std::isfinite(value)) return value;
  if (!read_degrees(text, value)) refuse(name, "a number, or degrees as in 45:30:00N");
  degrees = true;
  return value;
}

bool GrassHeader::is_whole() const {
  return lower_case(values_[kType].text) == "int";
}

double GrassHeader::null_value() const {
  double value = 0.0;
  return read_decimal(values_[kNull].text, value) ? value : std::numeric_limits<double>::quiet_NaN();
}

std::string_view GrassHeader::null_word() const {
  return has_null() ? std::string_view(values_[kNull].text) : std::string_view("*");
}

void GrassHeader::read(SourceInfo& info) const {
  for (const Name name : {kNorth, kSouth, kEast, kWest, kRows, kCols}) {
    if (values_[name].text.empty()) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: the header does not say {}:, which it must", path_, kNameTexts[name]));
    }
  }
  info.width = count(kCols);
  info.height = count(kRows);
  bool degrees = false;
  const double north = edge(kNorth, degrees);
  const double south = edge(kSouth, degrees);
  const double east = edge(kEast, degrees);
  const double west = edge(kWest, degrees);
  if (!(north > south)) refuse(kNorth, fmt::format("North of south: ({})", south));
  if (!(east > west)) refuse(kEast, fmt::format("East of west: ({})", west));
  Georeference& place = info.georeference;
  place.registration = Registration::kArea;
  if (degrees) place.unit = HorizontalUnit::kDegree;
  place.spacing_x = (east - west) / static_cast<double>(info.width);
  place.spacing_y = (north - south) / static_cast<double>(info.height);
  place.has_origin = true;
  place.origin_x = west + place.spacing_x / 2.0;
  place.origin_y = north - place.spacing_y / 2.0;
  const std::string type = lower_case(values_[kType].text);
  if (!type.empty() && type != "int" && type != "float" && type != "double") refuse(kType, "int, float or double");
  if (!values_[kMultiplier].text.empty()) {
    double scale = 0.0;
    if (!read_decimal(values_[kMultiplier].text, scale) || !std::isfinite(scale) || scale == 0.0) {
      refuse(kMultiplier, "a number other than 0");
    }
    info.z_scale = scale;
  }
}

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
      : FileSource(path, "ESRI ASCII grid", options), words_(*file_), grass_(path) {
    (void)choose_band(info_, options, 1);
    GridHeader header(path);
    std::string_view word;
    const bool any = read_header(header, word);
    if (is_grass_) {
      info_.format = "GRASS ASCII grid";
      grass_.read(info_);
      marked_ = true;
    } else {
      header.require_only(known_words());
      header.read_size(info_);
      header.read_place(info_);
      marked_ = header.has("nodatavalue") || header.has("nodata") || !options.void_values.empty();
    }
    require_room();
    scan(word, any);
    if (is_grass_) {
      const auto stored = void_value_as_stored(info_.sample_type, grass_.null_value());
      if (grass_.has_null() && stored && !std::isnan(*stored)) info_.void_values = {*stored};
    } else {
      header.read_void(info_);
    }
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
    const auto read_grass = [this](std::string_view word, double& value) {
      value = std::numeric_limits<double>::quiet_NaN();
      return word == grass_.null_word() || read_decimal(word, value);
    };
    const bool done = info_.sample_type == SampleType::kInt32 ? rows_->read<std::int32_t>(window, samples, read_whole)
                      : is_grass_                             ? rows_->read<double>(window, samples, read_grass)
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
      if (GrassHeader::is_name(word)) {
        read_grass_line(word);
        continue;
      }
      double special = 0.0;
      if (std::isalpha(static_cast<unsigned char>(word.front())) == 0 || read_decimal(word, special)) return true;
      const std::string name(word);
      const std::uint64_t line = words_.line();
      if (!words_.next(word)) refuse(ErrorCode::kCorrupt, fmt::format("{} has no value", printable(name)));
      if (is_grass_) {
        refuse(ErrorCode::kUnsupported,
               fmt::format("\"{} {}\" is no line of a GRASS ASCII header", printable(name), printable(word)));
      }
      header.add(name, word, line);
      is_esri_ = true;
    }
    return false;
  }

  /// "name: value" or "name:value".
  void read_grass_line(std::string_view word) {
    if (is_esri_) refuse(ErrorCode::kCorrupt, fmt::format("\"{}\" follows lines of an ESRI header", printable(word)));
    is_grass_ = true;
    const std::size_t colon = word.find(':');
    const std::string name(word.substr(0, colon));
    const std::uint64_t line = words_.line();
    word.remove_prefix(colon + 1);
    if (word.empty() && !words_.next(word)) refuse(ErrorCode::kCorrupt, name + ": has no value");
    grass_.add(name, word, line);
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
    if (is_grass_ && word == grass_.null_word() && std::isnan(grass_.null_value())) return false;
    const Shape shape = shape_of(word);
    if (!shape.number) refuse_word(word);
    if (is_grass_ && grass_.is_whole() && !shape.whole) {
      refuse(ErrorCode::kCorrupt, fmt::format("\"{}\" is no whole number, as type: int says", printable(word)));
    }
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
  GrassHeader grass_;
  bool is_grass_ = false;
  bool is_esri_ = false;
  std::optional<TextRows> rows_;
  char decimal_ = 0;
  bool marked_ = false;  // a void value is named
  std::string marker_;   // void by custom, seen in the file
};

}  // namespace

bool looks_like_ascii_grid(std::span<const std::byte> head) {
  const std::string_view word = first_word(text_of(head));
  if (GrassHeader::is_name(word)) return true;
  const std::string name = GridHeader::plain_name(word);
  return std::find(known_words().begin(), known_words().end(), name) != known_words().end();
}

std::unique_ptr<HeightSource> open_ascii_grid(const std::string& path, const OpenOptions& options) {
  // The header of a binary grid begins with the same words.
  if (lower_case(path).ends_with(".hdr")) return open_header_grid(path, options);
  return std::make_unique<AsciiGridSource>(path, options);
}

}  // namespace isohf
