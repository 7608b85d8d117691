// Writes a shaded picture of an archive's surface as a portable pixmap, on white where there is no elevation.
//   shade dem.isohf dem.ppm
#include <array>
#include <cstdio>
#include <fstream>

#include "isohf/shade.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: shade ARCHIVE PICTURE.ppm\n"), 2;
  try {
    const isohf::ArchiveReader archive(argv[1]);
    isohf::ShadeOptions options;
    options.size = isohf::shade_size(archive);
    options.sun = isohf::SunSide::kWest;
    options.sun_elevation_deg = 25.0;
    options.hillshade = true;
    isohf::Job job;
    job.progress = [](const isohf::Progress& at) {
      if (at.done == at.total)
        std::printf("%s: %lld %s\n", at.stage.c_str(), static_cast<long long>(at.total), at.unit.c_str());
    };
    std::ofstream picture(argv[2], std::ios::binary);
    picture << "P6\n" << options.size->first << ' ' << options.size->second << "\n255\n";
    isohf::shade_rows(
        archive, options,
        [&](std::span<const std::uint8_t> rows) {  // RGBA; alpha is the share of the pixel that has an elevation
          for (std::size_t i = 0; i < rows.size(); i += isohf::kShadeChannels) {
            std::array<char, 3> rgb{};
            for (std::size_t c = 0; c < 3; ++c) {
              rgb[c] = static_cast<char>(255 + (rows[i + c] - 255) * rows[i + 3] / 255);
            }
            picture.write(rgb.data(), rgb.size());
          }
        },
        job);
    picture.close();
    if (!picture) throw isohf::Error(isohf::ErrorCode::kIo, std::string(argv[2]) + ": cannot be written");
    std::printf("%s: %lld x %lld pixels\n", argv[2], static_cast<long long>(options.size->first),
                static_cast<long long>(options.size->second));
    return 0;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
