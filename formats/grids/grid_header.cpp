#include "formats/grids/grid_header.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "formats/io/text.h"
#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "isohf/error.h"

namespace isohf {
std::string GridHeader::plain_name(std::string_view name) {
  std::string plain;
  for (const char c : name) {
    if (c != '_' && c != '-') plain.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  }
  return plain;
}

void GridHeader::add(std::string_view name, std::string_view value, std::uint64_t line) {
  Word word{plain_name(name), std::string(value), line};
  const Word* known = find({word.name});
  if (known == nullptr) {
    words_.push_back(std::move(word));
  } else if (known->value != word.value) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: line {}: {} is \"{}\", on line {} it was \"{}\"; it must be given once", path_, line,
                            printable(name), printable(value), known->line, printable(known->value)));
  }
}

const GridHeader::Word* GridHeader::find(std::initializer_list<std::string_view> names) const {
  for (const std::string_view name : names) {
    for (const Word& word : words_) {
      if (word.name == name) return &word;
    }
  }
  return nullptr;
}

void GridHeader::refuse(const Word& word, std::string_view required) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {} is \"{}\", must be {}", path_, word.line,
                                               printable(word.name), printable(word.value), required));
}

std::optional<std::string> GridHeader::text(std::initializer_list<std::string_view> names) const {
  const Word* word = find(names);
  return word == nullptr ? std::nullopt : std::optional(word->value);
}

std::optional<double> GridHeader::number(std::initializer_list<std::string_view> names) const {
  const Word* word = find(names);
  if (word == nullptr) return std::nullopt;
  double value = 0.0;
  if (!read_decimal(word->value, value)) refuse(*word, "a number");
  return value;
}

std::optional<std::int64_t> GridHeader::count(std::initializer_list<std::string_view> names, std::int64_t least) const {
  const Word* word = find(names);
  if (word == nullptr) return std::nullopt;
  // "4.0" occurs, written by programs that keep every number as a float.
  std::string_view digits = word->value;
  const std::size_t point = digits.find('.');
  if (point != std::string_view::npos && digits.find_first_not_of('0', point + 1) == std::string_view::npos) {
    digits = digits.substr(0, point);
  }
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size() || value < least) {
    refuse(*word, fmt::format("a whole number from {} on", least));
  }
  return value;
}

void GridHeader::read_size(SourceInfo& info) const {
  const auto columns = count({"ncols", "ncol"}, 1);
  const auto rows = count({"nrows", "nrow"}, 1);
  if (!columns || !rows) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the header does not say {}, which it must", path_, !columns ? "ncols" : "nrows"));
  }
  info.width = *columns;
  info.height = *rows;
}

double GridHeader::spacing(std::initializer_list<std::string_view> names) const {
  const Word* word = find(names);
  if (word == nullptr) return 0.0;
  const double value = *number(names);
  if (!std::isfinite(value) || value <= 0.0) refuse(*word, "a positive number");
  return value;
}

/// Coordinate of the lowest (x: first, y: last) cell's centre along "x" or "y"; for ulxmap and ulymap of the first one.
std::optional<double> GridHeader::first_centre(std::string_view axis, double spacing, std::int64_t count) const {
  const bool x = axis == "x";
  const Word* corner = find({x ? "xllcorner" : "yllcorner"});
  const Word* centre = x ? find({"xllcenter", "xllcentre"}) : find({"yllcenter", "yllcentre"});
  const Word* upper = find({x ? "ulxmap" : "ulymap"});
  const int found = (corner != nullptr ? 1 : 0) + (centre != nullptr ? 1 : 0) + (upper != nullptr ? 1 : 0);
  if (found == 0) return std::nullopt;
  const Word* word = corner != nullptr ? corner : centre != nullptr ? centre : upper;
  if (found > 1) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {} is one of two words that place the {} axis; one "
                                                 "must be given",
                                                 path_, word->line, word->name, axis));
  }
  const double value = *number({std::string_view(word->name)});
  if (!std::isfinite(value)) refuse(*word, "a finite number");
  if (upper != nullptr) return value;
  const double steps = x ? 0.0 : static_cast<double>(count - 1);
  return value + (steps + (corner != nullptr ? 0.5 : 0.0)) * spacing;
}

void GridHeader::read_place(SourceInfo& info) const {
  Georeference& place = info.georeference;
  place.registration = Registration::kArea;
  const double cell = spacing({"cellsize"});
  const double dx = spacing({"dx", "xdim", "xcellsize"});
  const double dy = spacing({"dy", "ydim", "ycellsize"});
  if (cell > 0.0 && ((dx > 0.0 && dx != cell) || (dy > 0.0 && dy != cell))) {
    refuse(*find({"cellsize"}), fmt::format("the same as dx and dy ({} and {}), or absent", dx, dy));
  }
  if (cell == 0.0 && (dx > 0.0) != (dy > 0.0)) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the header gives the spacing of one axis alone; it must give both", path_));
  }
  const bool spaced = cell > 0.0 || dx > 0.0;
  place.spacing_x = dx > 0.0 ? dx : spaced ? cell : 1.0;
  place.spacing_y = dy > 0.0 ? dy : spaced ? cell : 1.0;
  const auto x = first_centre("x", place.spacing_x, info.width);
  const auto y = first_centre("y", place.spacing_y, info.height);
  if (x.has_value() != y.has_value() || (x && !spaced)) {
    info.warnings.push_back(loss(fmt::format("the header gives {}: the position is unknown",
                                             x && y ? "an origin without a spacing" : "the origin of one axis alone")));
    return;
  }
  if (!x) return;
  place.has_origin = true;
  place.origin_x = *x;
  place.origin_y = *y;
}

void GridHeader::read_void(SourceInfo& info) const {
  const std::optional<double> value = number({"nodatavalue", "nodata"});
  if (!value || std::isnan(*value)) return;
  const std::optional<double> stored = void_value_as_stored(info.sample_type, *value);
  if (stored) info.void_values = {*stored};
  if (!is_floating(info.sample_type)) return;
  if (*value <= -kBeyondAnyHeight) info.valid_min = -kBeyondAnyHeight;
  if (*value >= kBeyondAnyHeight) info.valid_max = kBeyondAnyHeight;
}

void GridHeader::require_only(const std::vector<std::string_view>& names) const {
  for (const Word& word : words_) {
    if (std::find(names.begin(), names.end(), word.name) == names.end()) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("{}: line {}: \"{} {}\" is no line of an ESRI grid header that isohf knows", path_,
                              word.line, printable(word.name), printable(word.value)));
    }
  }
}

}  // namespace isohf
