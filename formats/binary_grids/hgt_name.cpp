#include "formats/binary_grids/hgt_name.h"

#include <cctype>

namespace isohf {

std::optional<HgtCorner> hgt_corner_of(const std::string& path) {
  const std::string name = path.substr(path.find_last_of('/') + 1);
  if (name.size() < 7) return std::nullopt;
  const auto hemisphere = [&](std::size_t at) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(name[at])));
  };
  const auto digits = [&](std::size_t begin, std::size_t count) {
    int value = 0;
    for (std::size_t i = begin; i < begin + count; ++i) {
      if (std::isdigit(static_cast<unsigned char>(name[i])) == 0) return -1;
      value = value * 10 + (name[i] - '0');
    }
    return value;
  };
  const char north_south = hemisphere(0);
  const char east_west = hemisphere(3);
  if ((north_south != 'n' && north_south != 's') || (east_west != 'e' && east_west != 'w')) return std::nullopt;
  const int latitude = digits(1, 2);
  const int longitude = digits(4, 3);
  if (latitude < 0 || latitude > 90 || longitude < 0 || longitude > 180) return std::nullopt;
  return HgtCorner{east_west == 'w' ? -longitude : longitude, north_south == 's' ? -latitude : latitude};
}

}  // namespace isohf
