#include "formats/grids/grid_header.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

#include "formats/io/text_tokens.h"
#include "formats/open_options.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {

std::string GridHeader::plain_name(std::string_view name) {
  constexpr std::pair<std::string_view, std::string_view> kSame[] = {
      {"ncol", "ncols"},   {"nrow", "nrows"}, {"nodatavalue", "nodata"},  {"xllcentre", "xllcenter"}, {"xdim", "dx"},
      {"xcellsize", "dx"}, {"ydim", "dy"},    {"yllcentre", "yllcenter"}, {"ycellsize", "dy"}};
  std::string plain = lower_case(name);
  std::erase_if(plain, [](char c) { return c == '_' || c == '-'; });
  const auto* const same = std::ranges::find(kSame, plain, &std::pair<std::string_view, std::string_view>::first);
  return same == std::end(kSame) ? plain : std::string(same->second);
}

void GridHeader::add(std::string_view name, std::string_view value, std::uint64_t line) {
  const auto [known, is_new] = words_.try_emplace(plain_name(name), std::string(name), std::string(value), line);
  if (is_new || known->second.value == value) return;
  throw Error(ErrorCode::kCorrupt,
              fmt::format("{}: line {}: {} is \"{}\", on line {} it was \"{}\"; it must be given once", path_, line,
                          printable(name), printable(value), known->second.line, printable(known->second.value)));
}

void GridHeader::require_only(std::span<const std::string_view> names) const {
  for (const auto& [name, word] : words_) {
    if (std::ranges::find(names, name) != names.end()) continue;
    throw Error(ErrorCode::kUnsupported, fmt::format("{}: line {}: \"{} {}\" is not a line of an ESRI grid header",
                                                     path_, word.line, printable(word.name), printable(word.value)));
  }
}

const GridHeader::Word* GridHeader::find(std::string_view name) const {
  const auto found = words_.find(name);
  return found == words_.end() ? nullptr : &found->second;
}

void GridHeader::refuse(const Word& word, std::string_view required) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {} is \"{}\", must be {}", path_, word.line,
                                               printable(word.name), printable(word.value), required));
}

std::optional<std::string> GridHeader::text(std::string_view name) const {
  const Word* const word = find(name);
  return word == nullptr ? std::nullopt : std::optional(lower_case(word->value));
}

double GridHeader::number(const Word& word) const {
  double value = 0.0;
  if (!read_decimal(word.value, value)) refuse(word, "a number");
  return value;
}

std::optional<std::int64_t> GridHeader::count(std::string_view name, std::int64_t least) const {
  const Word* const word = find(name);
  if (word == nullptr) return std::nullopt;
  std::int64_t value = 0;
  const char* const end = word->value.data() + word->value.size();
  const auto [at, error] = std::from_chars(word->value.data(), end, value);
  // "4.0" is written by programs that keep every number as a float.
  const std::string_view rest(at, end);
  const bool is_whole = rest.empty() || (rest[0] == '.' && rest.find_first_not_of('0', 1) == rest.npos);
  if (error != std::errc{} || !is_whole || value < least)
    refuse(*word, fmt::format("a whole number from {} on", least));
  return value;
}

void GridHeader::read_size(SourceInfo& info) const {
  const auto columns = count("ncols", 1);
  const auto rows = count("nrows", 1);
  if (!columns || !rows) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the header does not say {}, which it must", path_, !columns ? "ncols" : "nrows"));
  }
  info.width = *columns;
  info.height = *rows;
}

double GridHeader::spacing(std::string_view name) const {
  const Word* const word = find(name);
  const double value = word == nullptr ? 0.0 : number(*word);
  if (word != nullptr && !(std::isfinite(value) && value > 0.0)) refuse(*word, "a positive number");
  return value;
}

/// Centre of the westernmost cell along 'x', of the northernmost along 'y'.
std::optional<double> GridHeader::origin(char axis, double spacing, std::int64_t count) const {
  const Word* found = nullptr;
  double cells = 0.0;  // from what is given to the origin
  const auto consider = [&](const std::string& name, double its_cells) {
    const Word* const word = find(name);
    if (word != nullptr && found != nullptr) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: line {}: {} is one of two words that place the {} axis; one "
                                                   "must be given",
                                                   path_, word->line, printable(word->name), axis));
    }
    if (word != nullptr) {
      found = word;
      cells = its_cells;
    }
  };
  const double to_north = axis == 'x' ? 0.0 : static_cast<double>(count - 1);
  consider(fmt::format("ul{}map", axis), 0.0);
  consider(fmt::format("{}llcenter", axis), to_north);
  consider(fmt::format("{}llcorner", axis), to_north + 0.5);
  if (found == nullptr) return std::nullopt;
  const double value = number(*found);
  if (!std::isfinite(value)) refuse(*found, "a finite number");
  return value + cells * spacing;
}

void GridHeader::read_place(SourceInfo& info) const {
  Georeference& place = info.georeference;
  place.registration = Registration::kArea;
  const double cell = spacing("cellsize");
  const double dx = spacing("dx");
  const double dy = spacing("dy");
  if (cell > 0.0 && ((dx > 0.0 && dx != cell) || (dy > 0.0 && dy != cell))) {
    refuse(*find("cellsize"), fmt::format("the same as dx and dy ({} and {}), or absent", dx, dy));
  }
  if (cell == 0.0 && (dx > 0.0) != (dy > 0.0)) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}: the header gives the spacing of one axis alone; it must give both", path_));
  }
  const double either = cell > 0.0 ? cell : dx;
  if (either > 0.0) {
    place.spacing_x = either;
    place.spacing_y = cell > 0.0 ? cell : dy;
  }
  const auto x = origin('x', place.spacing_x, info.width);
  const auto y = origin('y', place.spacing_y, info.height);
  if (x && y && either > 0.0) {
    place.has_origin = true;
    place.origin_x = *x;
    place.origin_y = *y;
  } else if (x || y) {
    info.warnings.push_back(loss(fmt::format("the header gives {}: the position is unknown",
                                             x && y ? "an origin without a spacing" : "the origin of one axis alone")));
  }
}

void GridHeader::read_nodata(SourceInfo& info) const {
  const Word* const word = find("nodata");
  const double value = word == nullptr ? std::nan("") : number(*word);
  if (std::isnan(value)) return;
  if (const auto stored = void_value_as_stored(info.sample_type, value)) info.void_values = {*stored};
  if (!is_floating(info.sample_type)) return;
  if (value <= -kBeyondAnyGround) info.valid_min = -kBeyondAnyGround;
  if (value >= kBeyondAnyGround) info.valid_max = kBeyondAnyGround;
}

}  // namespace isohf
