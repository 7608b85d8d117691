// Draws the surface of an archive with its shadows, as a binary PPM.
//   shade dem.isohf dem.ppm
#include <cstdio>
#include <fstream>

#include "isohf/isohf.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: shade ARCHIVE PICTURE.ppm\n"), 2;
  try {
    const isohf::ArchiveReader archive(argv[1]);
    isohf::ShadeOptions options;
    options.size = isohf::GridSize{640, 480};
    options.sun_elevation_deg = 20.0;
    const isohf::Picture picture = isohf::shade(archive, options);
    std::ofstream file(argv[2], std::ios::binary);
    file << "P6 " << picture.width << ' ' << picture.height << " 255\n";
    for (int row = 0; row < picture.height; ++row) {
      for (int column = 0; column < picture.width; ++column) {
        file.write(reinterpret_cast<const char*>(picture.pixel(column, row)), 3);  // without alpha
      }
    }
    if (!file.flush()) return std::fprintf(stderr, "%s: cannot be written\n", argv[2]), 1;
    std::printf("%d x %d pixels\n", picture.width, picture.height);
    return 0;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
