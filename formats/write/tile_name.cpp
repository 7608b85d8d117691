#include "formats/write/tile_name.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <string_view>

namespace isohf {
namespace {

/// As fmt writes it: no sign, no zero in front.
std::optional<std::int64_t> tile_number(std::string_view digits) {
  std::int64_t number = 0;
  const auto [end, failure] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool is_number = failure == std::errc() && number >= 0 && fmt::to_string(number) == digits;
  return is_number ? std::optional(number) : std::nullopt;
}

}  // namespace

std::optional<TileName> TileName::of(const std::string& path) {
  const std::filesystem::path file(path);
  const std::string name = file.stem().string();
  const std::size_t y = name.rfind("_y");
  const std::size_t x = y == std::string::npos || y == 0 ? std::string::npos : name.rfind("_x", y - 1);
  if (x == std::string::npos) return std::nullopt;
  const auto column = tile_number(std::string_view(name).substr(x + 2, y - x - 2));
  const auto row = tile_number(std::string_view(name).substr(y + 2));
  if (!column || !row) return std::nullopt;
  return TileName{(file.parent_path() / name.substr(0, x)).string(), *column, *row, file.extension().string()};
}

std::string TileName::path() const {
  return fmt::format("{}_x{}_y{}{}", stem, column, row, extension);
}

}  // namespace isohf
