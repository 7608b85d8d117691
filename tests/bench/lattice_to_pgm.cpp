// Writes an archive's vertices, each once, as one 16-bit PGM, for other compressors to try on the same samples; voids as
// the sample before them, which costs these least.
// usage: lattice_to_pgm ARCHIVE OUT.pgm; prints the number of samples.

#include <fmt/format.h>

#include <cstdio>
#include <fstream>
#include <vector>

#include "isohf/archive.h"
#include "isohf/error.h"

namespace {

int run(const std::string& archive_path, const std::string& out_path) {
  const isohf::ArchiveReader archive(archive_path);
  const isohf::TileGrid& grid = archive.grid();
  const isohf::TileShape& shape = grid.shape();
  if (archive.metadata().quantisation.type == isohf::CodeType::kF32) {
    throw isohf::Error(isohf::ErrorCode::kInvalidArgument, archive_path + ": holds floats, codes are wanted");
  }
  const std::uint32_t void_code = archive.metadata().quantisation.void_code();
  // Of a tile, all but padding and the row and column that its neighbours hold as well.
  const int columns = shape.columns() - 3;
  const int rows = shape.rows() - 3;
  const std::int64_t width = columns * grid.tile_columns();
  std::ofstream out(out_path, std::ios::binary);
  out << fmt::format("P5\n{} {}\n65535\n", width, rows * grid.tile_rows());
  std::vector<char> band(static_cast<std::size_t>(width * rows * 2));
  for (std::int64_t tile_row = 0; tile_row < grid.tile_rows(); ++tile_row) {
    for (std::int64_t tile_column = 0; tile_column < grid.tile_columns(); ++tile_column) {
      const isohf::TileCodes tile = archive.read_tile({tile_column, tile_row});
      std::uint16_t before = 0;
      for (int r = 0; r < rows; ++r) {
        for (int c = 0; c < columns; ++c) {
          const std::uint16_t stored = tile.codes[static_cast<std::size_t>((r + 1) * shape.columns() + c + 1)];
          const std::uint16_t code = stored == void_code ? before : stored;
          before = code;
          const auto at = static_cast<std::size_t>(2 * (r * width + tile_column * columns + c));
          band[at] = static_cast<char>(code >> 8U);
          band[at + 1] = static_cast<char>(code & 0xffU);
        }
      }
    }
    out.write(band.data(), static_cast<std::streamsize>(band.size()));
  }
  out.close();
  if (!out) throw isohf::Error(isohf::ErrorCode::kIo, out_path + ": cannot be written");
  fmt::print("{}\n", width * rows * grid.tile_rows());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    fmt::print(stderr, "usage: lattice_to_pgm ARCHIVE OUT.pgm\n");
    return 2;
  }
  try {
    return run(argv[1], argv[2]);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
