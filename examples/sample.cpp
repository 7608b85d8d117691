// Prints elevation and normal at points of an archive, given as x and z in world units.
//   sample dem.isohf points.txt
#include <cstdio>
#include <fstream>

#include "isohf/isohf.h"

int main(int argc, char** argv) {
  if (argc != 3) return std::fprintf(stderr, "usage: sample ARCHIVE POINTS\n"), 2;
  try {
    const isohf::ArchiveReader archive(argv[1]);
    isohf::Surface surface(archive);
    std::ifstream points(argv[2]);
    if (!points) return std::fprintf(stderr, "%s: cannot be opened\n", argv[2]), 1;
    for (isohf::WorldPoint point{}; points >> point.x >> point.z;) {
      const isohf::SurfaceSample found = surface.at(point);
      switch (found.state) {
        case isohf::SurfaceState::kSurface:
          std::printf("%g %g: %.3f  normal %.4f %.4f %.4f\n", point.x, point.z, found.elevation, found.normal[0],
                      found.normal[1], found.normal[2]);
          break;
        case isohf::SurfaceState::kNodata:
          std::printf("%g %g: nodata\n", point.x, point.z);
          break;
        case isohf::SurfaceState::kOutside:
          std::printf("%g %g: outside\n", point.x, point.z);
          break;
      }
    }
    if (!points.eof()) return std::fprintf(stderr, "%s: holds what is no number\n", argv[2]), 1;
    return 0;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
