#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <functional>
#include <string>

namespace isohf::test {

constexpr std::size_t kDtedHeader = 3428;

inline void put(std::string& bytes, std::size_t at, const std::string& text) {
  bytes.replace(at, text.size(), text);
}

/// Puts the checksum behind a record.
inline void sign(std::string& cell, std::size_t record, int posts) {
  std::uint32_t sum = 0;
  const std::size_t end = record + 8 + 2 * static_cast<std::size_t>(posts);
  for (std::size_t i = record; i < end; ++i) sum += static_cast<unsigned char>(cell[i]);
  for (std::size_t b = 0; b < 4; ++b) cell[end + b] = static_cast<char>(sum >> (24 - 8 * b));
}

/// A DTED cell of `columns` x `posts` at 80 W, 43 N, 30" by 15" apart; heights by column and post from the South.
inline std::string dted_cell(int columns, int posts, const std::function<int(int column, int post)>& height) {
  std::string bytes(kDtedHeader, ' ');
  put(bytes, 0, "UHL10800000W0430000N030001500200U  ");
  put(bytes, 47, fmt::format("{:04}{:04}0", columns, posts));
  put(bytes, 80, "DSIU");
  put(bytes, 80 + 141, "MSLWGS84");
  put(bytes, 80 + 264, fmt::format("0000000.001500300{:04}{:04}00", posts, columns));
  put(bytes, 728, "ACC");
  for (int c = 0; c < columns; ++c) {
    std::string record = {'\xAA', '\0', '\0', static_cast<char>(c), '\0', static_cast<char>(c), '\0', '\0'};
    for (int p = 0; p < posts; ++p) {
      const int value = height(c, p);
      record.push_back(static_cast<char>((std::abs(value) >> 8) | (value < 0 ? 0x80 : 0)));
      record.push_back(static_cast<char>(std::abs(value) & 0xFF));
    }
    const std::size_t at = bytes.size();
    bytes += record + std::string(4, '\0');
    sign(bytes, at, posts);
  }
  return bytes;
}

}  // namespace isohf::test
