// Measures the tile codec on a single-band 16-bit or float TIFF: the raster is resampled bilinearly to the lattice, cut
// into tiles, coded and decoded. usage: codec_bench FILE [STEP=1] [COLUMNS=240] [ROWS=243] [u16|f32] [REPEATS=3]

#include <fmt/format.h>
#include <tiffio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <limits>
#include <string>
#include <vector>

#include "isohf/archive/codec/tile_decoder.h"
#include "isohf/archive/codec/tile_encoder.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/error.h"
#include "isohf/lattice.h"

namespace {

struct Raster {
  int columns = 0;
  int rows = 0;
  std::vector<float> samples;
  [[nodiscard]] double at(int c, int r) const {
    return static_cast<double>(
        samples[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(c)]);
  }
};

/// Sample i of a buffer, as a height.
template <typename T>
float sample(const std::vector<char>& buffer, std::size_t i) {
  T value;
  std::memcpy(&value, buffer.data() + i * sizeof(T), sizeof(T));
  return static_cast<float>(value);
}

/// Bit for bit: a void is a NaN, which is not equal to itself.
bool are_same(const isohf::TileCodes& a, const isohf::TileCodes& b) {
  return a.type == b.type && a.codes == b.codes && a.heights.size() == b.heights.size() &&
         std::memcmp(a.heights.data(), b.heights.data(), a.heights.size() * sizeof(float)) == 0;
}

Raster read_tiff(const std::string& path) {
  TIFFSetWarningHandler(nullptr);
  TIFF* tiff = TIFFOpen(path.c_str(), "r");
  if (tiff == nullptr) throw isohf::Error(isohf::ErrorCode::kIo, path);
  std::uint32_t width = 0, height = 0;
  std::uint16_t bits = 0, format = 1;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &height);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_BITSPERSAMPLE, &bits);
  TIFFGetFieldDefaulted(tiff, TIFFTAG_SAMPLEFORMAT, &format);
  Raster raster{static_cast<int>(width), static_cast<int>(height), std::vector<float>(std::size_t{width} * height)};
  const bool tiled = TIFFIsTiled(tiff) != 0;
  std::uint32_t tile_width = width, tile_height = 1;
  if (tiled) {
    TIFFGetField(tiff, TIFFTAG_TILEWIDTH, &tile_width);
    TIFFGetField(tiff, TIFFTAG_TILELENGTH, &tile_height);
  }
  std::vector<char> buffer(static_cast<std::size_t>(tiled ? TIFFTileSize(tiff) : TIFFScanlineSize(tiff)));
  for (std::uint32_t y = 0; y < height; y += tile_height) {
    for (std::uint32_t x = 0; x < width; x += tile_width) {
      if (tiled) {
        TIFFReadTile(tiff, buffer.data(), x, y, 0, 0);
      } else {
        TIFFReadScanline(tiff, buffer.data(), y);
      }
      for (std::uint32_t j = 0; j < tile_height && y + j < height; ++j) {
        for (std::uint32_t i = 0; i < tile_width && x + i < width; ++i) {
          const std::size_t k = std::size_t{j} * tile_width + i;
          float value = 0;
          if (bits == 32) {
            value = sample<float>(buffer, k);
          } else if (format == 2) {
            value = sample<std::int16_t>(buffer, k);
          } else {
            value = sample<std::uint16_t>(buffer, k);
          }
          if (value <= -32767.0F) value = std::numeric_limits<float>::quiet_NaN();
          raster.samples[std::size_t{y + j} * width + x + i] = value;
        }
      }
    }
  }
  TIFFClose(tiff);
  return raster;
}

double sample(const Raster& raster, double x, double y) {
  const int c = std::min(std::max(static_cast<int>(std::floor(x)), 0), raster.columns - 2);
  const int r = std::min(std::max(static_cast<int>(std::floor(y)), 0), raster.rows - 2);
  const double u = std::min(std::max(x - c, 0.0), 1.0), v = std::min(std::max(y - r, 0.0), 1.0);
  return (1 - v) * ((1 - u) * raster.at(c, r) + u * raster.at(c + 1, r)) +
         v * ((1 - u) * raster.at(c, r + 1) + u * raster.at(c + 1, r + 1));
}

/// CPU seconds of this thread: other work on the machine does not count.
double now() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}
double seconds_since(double start) {
  return now() - start;
}

int run(int argc, char** argv) {
  const auto argument = [&](int i, const char* otherwise) { return std::string(i < argc ? argv[i] : otherwise); };
  const Raster raster = read_tiff(argument(1, ""));
  const double step = std::stod(argument(2, "1"));
  const isohf::TileShape shape =
      isohf::TileShape::make(std::stoi(argument(3, "240")), std::stoi(argument(4, "243")), 1);
  const bool floats = argument(5, "u16") == "f32";
  const int repeats = std::stoi(argument(6, "3"));
  const double spacing = 1.07457, row_spacing = 0.93060;
  double low = 1e30;
  for (const float value : raster.samples) low = std::min(low, std::isnan(value) ? low : static_cast<double>(value));
  const double extent_x = spacing * shape.cell_columns(), extent_z = row_spacing * shape.cell_rows();
  const int tile_columns = static_cast<int>((raster.columns - 1) / extent_x);
  const int tile_rows = static_cast<int>((raster.rows - 1) / extent_z);

  std::vector<isohf::TileCodes> tiles;
  for (int tile_row = 0; tile_row < tile_rows; ++tile_row) {
    for (int tile_column = 0; tile_column < tile_columns; ++tile_column) {
      isohf::TileCodes tile;
      tile.type = floats ? isohf::CodeType::kF32 : isohf::CodeType::kU16;
      for (int r = 0; r < shape.rows(); ++r) {
        for (int c = 0; c < shape.columns(); ++c) {
          const auto vertex = isohf::object_from_grid(shape, isohf::GridVertex{c, r});
          const double height = sample(raster, tile_column * extent_x + vertex.x * spacing / 2,
                                       tile_row * extent_z + vertex.z * row_spacing);
          if (floats) {
            tile.heights.push_back(static_cast<float>(height));
          } else {
            tile.codes.push_back(std::isnan(height) ? 65535
                                                    : static_cast<std::uint16_t>(std::lround((height - low) / step)));
          }
        }
      }
      tiles.push_back(std::move(tile));
    }
  }
  const double samples = static_cast<double>(shape.stored_vertex_count()) * static_cast<double>(tiles.size());
  double encode_seconds = 1e9, decode_seconds = 1e9, plain_seconds = 1e9, inflate_seconds = 1e9;
  std::size_t bytes = 0;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    double start = now();
    std::vector<isohf::EncodedTile> encoded;
    for (const auto& tile : tiles) encoded.push_back(encode_tile(shape, tile));
    encode_seconds = std::min(encode_seconds, seconds_since(start));
    start = now();
    std::vector<std::vector<std::byte>> payloads;
    bytes = 0;
    for (const auto& tile : encoded) {
      bytes += tile.deflated.size();
      payloads.emplace_back(tile.payload_bytes);
      isohf::inflate_exactly(tile.deflated, payloads.back());
    }
    inflate_seconds = std::min(inflate_seconds, seconds_since(start));
    bool same = true;
    const auto time_decoding = [&](double& seconds, const auto& decode) {
      const double from = now();
      for (std::size_t i = 0; i < tiles.size(); ++i) {
        if (encoded[i].is_empty) continue;
        const isohf::TileCodes decoded = decode(i);
        same &= are_same(decoded, tiles[i]);
      }
      seconds = std::min(seconds, seconds_since(from));
    };
    time_decoding(plain_seconds, [&](std::size_t i) { return decode_tile_slowly(shape, tiles[i].type, payloads[i]); });
    time_decoding(decode_seconds, [&](std::size_t i) { return decode_tile(shape, tiles[i].type, payloads[i]); });
    if (!same) fmt::print("DIFFERENT\n");
  }
  fmt::print(
      "{} tiles, {:.0f} samples: {:.4f} bits/sample; encode {:.1f} M samples/s, inflate {:.1f}, decode {:.1f}, "
      "plainly {:.1f}\n",
      tiles.size(), samples, 8.0 * static_cast<double>(bytes) / samples, samples / encode_seconds / 1e6,
      samples / inflate_seconds / 1e6, samples / decode_seconds / 1e6, samples / plain_seconds / 1e6);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
