#pragma once

#include <fstream>
#include <string>

namespace isohf::test {

/// An ASCII grid of 40 x 40 whole numbers, which differ from one `seed` to the next; `odd` stands in one place where it
/// is not empty.
inline std::string small_grid(int seed = 0, const std::string& odd = "") {
  std::string text = "ncols 40\nnrows 40\nxllcorner 0\nyllcorner 0\ncellsize 30\n";
  for (int row = 0; row < 40; ++row) {
    for (int column = 0; column < 40; ++column) {
      text += column == 7 && row == 7 && !odd.empty() ? odd : std::to_string(100 + row * (column + seed) % 17);
      text += column == 39 ? "\n" : " ";
    }
  }
  return text;
}

inline void write_text(const std::string& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

inline std::string read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace isohf::test
