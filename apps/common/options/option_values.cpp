#include "options/option_values.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <cmath>
#include <limits>

#include "isohf/base/text/number_text.h"
#include "isohf/error.h"

namespace isohf::cli {
namespace {

[[noreturn]] void refuse(const std::string& text, const std::string& required) {
  throw Error(ErrorCode::kInvalidArgument, ErrorParts{"", "'" + text + "'", required, ""});
}

/// Letters to insert, leave out, replace, or swap with their neighbour.
std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      d[i][j] = i + j;
      if (i == 0 || j == 0) continue;
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

}  // namespace

double parse_number(const std::string& text) {
  return parse_number_in(text, -std::numeric_limits<double>::max(), std::numeric_limits<double>::max());
}

double parse_positive_number(const std::string& text) {
  return parse_number_in(text, std::numeric_limits<double>::min(), std::numeric_limits<double>::max());
}

double parse_number_in(const std::string& text, double least, double most) {
  const std::optional<double> value = number_from(text);
  if (value && *value >= least && *value <= most) return *value;
  const bool has_end = most < std::numeric_limits<double>::max();
  refuse(text, has_end       ? fmt::format("a number from {} to {}", least, most)
               : least > 0.0 ? "a number greater than 0"
                             : "a finite number");
}

std::int64_t parse_whole_number(const std::string& text, std::int64_t least, std::int64_t most) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || value < least || value > most) {
    refuse(text, fmt::format("a whole number from {} to {}", least, most));
  }
  return value;
}

std::pair<std::int64_t, std::int64_t> parse_size(const std::string& text, std::int64_t least, std::int64_t most) {
  const std::size_t cross = text.find_first_of("xX");
  const std::string required = fmt::format("COLUMNSxROWS, two whole numbers from {} to {}", least, most);
  if (cross == std::string::npos) refuse(text, required);
  try {
    return {parse_whole_number(text.substr(0, cross), least, most),
            parse_whole_number(text.substr(cross + 1), least, most)};
  } catch (const Error&) {
    refuse(text, required);
  }
}

ShadePalette parse_palette(const std::string& text) {
  constexpr ShadePalette kPalettes[] = {ShadePalette::kElevation, ShadePalette::kGray, ShadePalette::kMars};
  return kPalettes[parse_word(text, {"elevation", "gray", "mars"})];
}

std::array<int, 3> parse_date(const std::string& text) {
  constexpr const char* kForm = "a day of the calendar, as 2026-06-21";
  if (text.size() != 10 || text[4] != '-' || text[7] != '-') refuse(text, kForm);
  const auto part = [&](std::size_t at, std::size_t size) {
    int number = 0;
    const char* const end = text.data() + at + size;
    if (std::from_chars(text.data() + at, end, number).ptr != end) refuse(text, kForm);
    return number;
  };
  const std::array<int, 3> date{part(0, 4), part(5, 2), part(8, 2)};
  const std::chrono::year_month_day day(std::chrono::year{date[0]}, std::chrono::month(static_cast<unsigned>(date[1])),
                                        std::chrono::day(static_cast<unsigned>(date[2])));
  if (date[0] < 1 || !day.ok()) refuse(text, kForm);
  return date;
}

double parse_time(const std::string& text) {
  constexpr const char* kForm = "a time from 0:00 to 24:00, as 14:30";
  const std::size_t colon = text.find(':');
  try {
    const auto hours = static_cast<double>(parse_whole_number(text.substr(0, colon), 0, 24));
    if (colon == std::string::npos) return hours;
    const auto minutes = static_cast<double>(parse_whole_number(text.substr(colon + 1), 0, 59));
    if (text.size() - colon == 3 && hours + minutes / 60.0 <= 24.0) return hours + minutes / 60.0;
  } catch (const Error&) {
  }
  refuse(text, kForm);
}

std::pair<double, double> parse_range(const std::string& text) {
  const std::size_t colon = std::min(text.find_first_of(":,"), text.size());
  const std::optional<double> low = number_from(text.substr(0, colon));
  const std::optional<double> high = number_from(std::string_view(text).substr(std::min(colon + 1, text.size())));
  if (!low || !high || !std::isfinite(*low) || !std::isfinite(*high)) refuse(text, "MIN:MAX, two finite numbers");
  if (!(*low < *high)) refuse(text, "MIN:MAX with MIN less than MAX");
  return {*low, *high};
}

std::vector<double> parse_numbers(const std::string& text) {
  std::vector<double> numbers;
  for (std::size_t start = 0; start <= text.size();) {
    const std::size_t end = std::min(text.find(',', start), text.size());
    const std::optional<double> value = number_from(std::string_view(text).substr(start, end - start));
    if (!value) refuse(text, "numbers separated by commas, as in 5,15,30");
    numbers.push_back(*value);
    start = end + 1;
  }
  return numbers;
}

std::uint64_t parse_bytes(const std::string& text) {
  const std::string required = "a size in bytes such as 400M, 1.5GiB or 2GB";
  const std::size_t digits = std::min(text.find_first_not_of("0123456789."), text.size());
  const std::optional<double> value = number_from(text.substr(0, digits));
  if (!value) refuse(text, required);
  std::string unit = text.substr(digits);
  double factor = 1.0;
  if (!unit.empty() && unit != "B") {
    const std::size_t power = std::string_view("KMGT").find(static_cast<char>(std::toupper(unit[0])));
    const std::string rest = unit.substr(1);
    if (power == std::string::npos || !(rest.empty() || rest == "iB" || rest == "B")) refuse(text, required);
    factor = std::pow(rest == "B" ? 1000.0 : 1024.0, static_cast<double>(power) + 1.0);
  }
  const double bytes = std::floor(*value * factor);
  if (!(bytes >= 1.0) || bytes > 9e18) refuse(text, required);
  return static_cast<std::uint64_t>(bytes);
}

TileRange parse_tile_range(const std::string& text) {
  constexpr std::int64_t kMost = 999999999;
  const std::size_t comma = text.find(',');
  const auto range = [&](const std::string& part) {
    const std::size_t colon = part.find(':');
    return std::pair(parse_whole_number(part.substr(0, colon), 0, kMost),
                     parse_whole_number(colon == std::string::npos ? "" : part.substr(colon + 1), 0, kMost));
  };
  try {
    const auto [west, east] = range(text.substr(0, comma));
    const auto [north, south] = range(comma == std::string::npos ? "" : text.substr(comma + 1));
    const TileRange tiles{{west, north}, {east, south}};
    if (!tiles.is_empty()) return tiles;
  } catch (const Error&) {
  }
  refuse(text, "A:B,C:D: columns A to B-1 and rows C to D-1 of tiles, from 0");
}

std::size_t parse_word(const std::string& text, const std::vector<std::string>& words) {
  std::string list;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == text) return i;
    list += (i == 0 ? "" : i + 1 == words.size() ? " or " : ", ") + words[i];
  }
  refuse(text, list + did_you_mean(text, words));
}

std::string did_you_mean(const std::string& text, const std::vector<std::string>& candidates) {
  constexpr std::size_t kLongest = 64;
  std::string nearest;
  std::size_t least = std::max<std::size_t>(1, text.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    if (text.size() > kLongest || candidate.size() < 3) continue;
    const bool is_begun = text.size() >= 3 && candidate.starts_with(text);
    const std::size_t distance = is_begun ? 1 : edit_distance(text, candidate);
    if (distance >= least) continue;
    least = distance;
    nearest = candidate;
  }
  return nearest.empty() ? "" : "; did you mean " + nearest + "?";
}

}  // namespace isohf::cli
