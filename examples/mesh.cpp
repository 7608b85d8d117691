// Writes a tile and its East neighbour as a Wavefront .obj: the first one at half the detail, and no crack between them.
//   mesh dem.isohf COLUMN ROW mesh.obj
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "isohf/isohf.h"

int main(int argc, char** argv) {
  if (argc != 5) return std::fprintf(stderr, "usage: mesh ARCHIVE COLUMN ROW MESH.obj\n"), 2;
  try {
    const isohf::ArchiveReader archive(argv[1]);
    const isohf::TileMesh mesh(archive.grid().shape());  // the same for all tiles
    const isohf::TileIndex west{std::atoll(argv[2]), std::atoll(argv[3])};
    const isohf::TileIndex east{west.column + 1, west.row};
    isohf::VertexOptions options;
    options.origin = archive.grid().world_from_object(west, {0.0, 0.0});

    std::ofstream file(argv[4]);
    file.precision(9);
    long long written = 0;
    long long triangles = 0;
    for (const isohf::TileIndex tile : {west, east}) {
      const int level = tile == west ? std::min(1, mesh.levels() - 1) : 0;
      const std::vector<double> elevations = archive.read_elevations(tile);
      const auto vertices = isohf::tile_vertices(archive.metadata(), tile, elevations, options);
      std::vector<long long> numbers(vertices.size(), 0);  // in the file, from 1; 0: not written
      const std::vector<std::uint32_t> indices = mesh.triangles(level, elevations);
      for (const std::uint32_t index : indices) {
        if (numbers[index] != 0) continue;
        numbers[index] = ++written;
        const auto& [position, normal] = vertices[index];
        file << "v " << position[0] << ' ' << position[1] << ' ' << position[2] << "\nvn " << normal[0] << ' '
             << normal[1] << ' ' << normal[2] << '\n';
      }
      for (std::size_t i = 0; i < indices.size(); ++i) {
        const long long number = numbers[indices[i]];
        file << (i % 3 == 0 ? "f " : " ") << number << "//" << number << (i % 3 == 2 ? "\n" : "");
      }
      triangles += static_cast<long long>(indices.size() / 3);
    }
    if (!file.flush()) return std::fprintf(stderr, "%s: cannot be written\n", argv[4]), 1;
    std::printf("%lld vertices, %lld triangles\n", written, triangles);
    return 0;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
