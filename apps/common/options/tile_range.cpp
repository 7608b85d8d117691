#include "options/tile_range.h"

#include <fmt/format.h>

#include <utility>

#include "isohf/error.h"

namespace isohf::cli {

TileRange parse_tile_range(const std::string& text) {
  const auto refuse = [&]() -> std::int64_t {
    throw Error(
        ErrorCode::kInvalidArgument,
        fmt::format("found \"{}\", must be A:B,C:D: columns A to B-1 and rows C to D-1 of tiles, from 0", text));
  };
  const auto split = [&](const std::string& of, char at) {
    const std::size_t place = of.find(at);
    if (place == std::string::npos) refuse();
    return std::pair(of.substr(0, place), of.substr(place + 1));
  };
  const auto number = [&](const std::string& of) {
    return of.empty() || of.find_first_not_of("0123456789") != std::string::npos || of.size() > 9 ? refuse()
                                                                                                  : std::stoll(of);
  };
  const auto [columns, rows] = split(text, ',');
  const auto [west, east] = split(columns, ':');
  const auto [north, south] = split(rows, ':');
  const TileRange range{{number(west), number(north)}, {number(east), number(south)}};
  if (range.is_empty()) refuse();
  return range;
}

}  // namespace isohf::cli
