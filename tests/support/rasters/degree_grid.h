#pragma once

#include <cstdint>
#include <fstream>
#include <functional>
#include <string>

namespace isohf::test {

inline constexpr const char* kWgs84 =
    "GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,298.257223563]],PRIMEM[\"Greenwich\",0],"
    "UNIT[\"degree\",0.0174532925199433]]";

/// STEM.flt, .hdr and .prj: a GridFloat grid whose South-West corner is given. -9999 is void.
inline void write_gridfloat(const std::string& stem, std::int64_t columns, std::int64_t rows, double west, double south,
                            double cell, const std::function<float(std::int64_t column, std::int64_t row)>& sample,
                            const char* system = kWgs84) {
  std::ofstream samples(stem + ".flt", std::ios::binary);
  for (std::int64_t r = 0; r < rows; ++r) {
    for (std::int64_t c = 0; c < columns; ++c) {
      const float height = sample(c, r);
      samples.write(reinterpret_cast<const char*>(&height), sizeof height);
    }
  }
  std::ofstream header(stem + ".hdr");
  header.precision(17);
  header << "ncols " << columns << "\nnrows " << rows << "\nxllcorner " << west << "\nyllcorner " << south
         << "\ncellsize " << cell << "\nNODATA_value -9999\nbyteorder LSBFIRST\n";
  std::ofstream(stem + ".prj") << system;
}

/// The same of elevations by longitude and latitude: the first sample lies half a cell inside its corner.
inline void write_degrees(const std::string& stem, std::int64_t columns, std::int64_t rows, double west, double south,
                          double cell, const std::function<double(double longitude, double latitude)>& height_at,
                          const char* system = kWgs84) {
  const auto sample = [&](std::int64_t c, std::int64_t r) {
    return static_cast<float>(
        height_at(west + (static_cast<double>(c) + 0.5) * cell, south + (static_cast<double>(rows - r) - 0.5) * cell));
  };
  write_gridfloat(stem, columns, rows, west, south, cell, sample, system);
}

}  // namespace isohf::test
