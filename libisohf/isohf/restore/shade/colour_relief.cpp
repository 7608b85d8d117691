#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>

#include "isohf/error.h"
#include "isohf/shade.h"

namespace isohf {
namespace {

constexpr std::pair<std::string_view, std::array<std::uint8_t, 3>> kNames[] = {
    {"white", {255, 255, 255}}, {"black", {0, 0, 0}},        {"red", {255, 0, 0}},        {"green", {0, 255, 0}},
    {"blue", {0, 0, 255}},      {"yellow", {255, 255, 0}},   {"magenta", {255, 0, 255}},  {"cyan", {0, 255, 255}},
    {"aqua", {0, 255, 255}},    {"grey", {190, 190, 190}},   {"gray", {190, 190, 190}},   {"orange", {255, 165, 0}},
    {"brown", {165, 42, 42}},   {"purple", {160, 100, 240}}, {"violet", {160, 100, 240}}, {"indigo", {75, 0, 130}},
};

bool read(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kBetween = " \t,:;\r";
  std::vector<std::string_view> words;
  for (std::size_t at = line.find_first_not_of(kBetween); at != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(kBetween, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kBetween, end);
  }
  return words;
}

}  // namespace

std::vector<ColourStop> read_colour_relief(const std::string& path, const Metadata& metadata) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  std::ifstream file(path, std::ios::binary);
  std::string text(kMostBytes + 1, ' ');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file.eof()) {  // neither opened, or not readable, or longer
    if (file)
      throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: more than {} bytes of colours", path, kMostBytes));
    throw Error(ErrorCode::kIo, path + ": cannot read the palette");
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  const double low = metadata.statistics.min.value_or(0.0);
  const double high = metadata.statistics.max.value_or(0.0);
  std::vector<ColourStop> stops;
  int number = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::vector<std::string_view> words = words_of(std::string_view(text).substr(at, end - at));
    at = end + 1;
    ++number;
    const auto fail = [&](const char* what) {
      throw Error(
          ErrorCode::kInvalidArgument,
          fmt::format("{}: line {}: {}, must be an elevation or a percentage, and red, green, blue from 0 to 255 or "
                      "a colour's name",
                      path, number, what));
    };
    if (words.empty() || words[0].starts_with('#') || words[0].starts_with("//")) continue;
    if (words[0] == "nv" || words[0] == "NV") continue;  // voids are transparent
    ColourStop stop;
    const bool is_share = words[0].ends_with('%');
    if (!read(is_share ? words[0].substr(0, words[0].size() - 1) : words[0], stop.elevation)) fail("no elevation");
    if (is_share) stop.elevation = low + (high - low) * stop.elevation / 100.0;
    std::array<std::uint8_t, 3> colour{};
    if (words.size() == 2) {
      const auto* const named = std::find_if(std::begin(kNames), std::end(kNames), [&](const auto& known) {
        return std::ranges::equal(words[1], known.first,
                                  [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a + 32 : a) == b; });
      });
      if (named == std::end(kNames)) fail("no colour");
      colour = named->second;
    } else {
      if (words.size() < 4 || words.size() > 5) fail("found too few or too many numbers");
      for (std::size_t k = 0; k + 1 < words.size(); ++k) {
        double value = 0.0;
        if (!read(words[k + 1], value) || value < 0.0 || value > 255.0) fail("no colour");
        if (k < 3) colour[k] = static_cast<std::uint8_t>(std::lround(value));  // opacity is not used
      }
    }
    stop.red = colour[0];
    stop.green = colour[1];
    stop.blue = colour[2];
    stops.push_back(stop);
  }
  if (stops.empty()) throw Error(ErrorCode::kInvalidArgument, path + ": no line has an elevation and a colour");
  std::stable_sort(stops.begin(), stops.end(),
                   [](const ColourStop& a, const ColourStop& b) { return a.elevation < b.elevation; });
  return stops;
}

}  // namespace isohf
