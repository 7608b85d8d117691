#pragma once

#include <fstream>
#include <functional>
#include <string>

namespace isohf::test {

/// Writes a geoid as GeographicLib's .pgm: heights on a grid of `columns` longitudes from 0 on and `rows` latitudes
/// from 90 to -90, in steps of 0.003 m from -100 m on. columns is even, rows is odd.
inline void write_geoid(const std::string& path, int columns, int rows,
                        const std::function<double(double longitude, double latitude)>& height_at) {
  std::ofstream file(path, std::ios::binary);
  file << "P5\n# Geoid file of a test\n# Description A small geoid\n# DateTime 2026-01-01 00:00:00\n# Offset -100\n"
       << "# Scale 0.003\n# Origin 90N 0E\n"
       << columns << ' ' << rows << "\n65535\n";
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const double height = height_at(360.0 * c / columns, 90.0 - 180.0 * r / (rows - 1));
      const auto code = static_cast<unsigned>((height + 100.0) / 0.003 + 0.5);
      file.put(static_cast<char>(code >> 8U)).put(static_cast<char>(code & 255U));
    }
  }
}

}  // namespace isohf::test
