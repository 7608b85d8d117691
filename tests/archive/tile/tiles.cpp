#include "archive/tile/tiles.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/writer.h"

namespace isohf::test {
namespace {

double terrain(double x, double z, std::uint32_t seed) {
  const double phase = static_cast<double>(seed % 100);
  return 4000.0 + 900.0 * std::sin(x * 0.03 + phase) * std::cos(z * 0.021) + 200.0 * std::sin(x * 0.2 + z * 0.13) +
         9.0 * std::sin(x * 1.7 - z * 1.1 + phase);
}

bool is_void_there(Kind kind, int c, int r, std::uint32_t random) {
  switch (kind) {
    case Kind::kVoidIsland:
      return (c - 3) * (c - 3) + (r - 4) * (r - 4) < 8;
    case Kind::kVoidNoise:
      return random % 4 == 0;
    case Kind::kAllVoid:
      return true;
    default:
      return false;
  }
}

}  // namespace

TileCodes make_tile(const TileShape& shape, CodeType type, Kind kind, std::uint32_t seed) {
  std::mt19937 random(seed);
  const Quantisation quantisation{type, 0.0, 1.0};
  const std::uint32_t most = quantisation.max_code();
  TileCodes tile;
  tile.type = type;
  for (int r = 0; r < shape.rows(); ++r) {
    for (int c = 0; c < shape.columns(); ++c) {
      const auto noise = static_cast<std::uint32_t>(random());
      double value = terrain(c, r, seed) + noise % 3;
      if (kind == Kind::kConstant) value = 77;
      if (kind == Kind::kPlane) value = 3 * c + 2 * r;
      if (kind == Kind::kNoise) value = noise % (most + 1);
      if (kind == Kind::kExtremes) value = noise % 2 == 0 ? 0 : most;
      if (kind == Kind::kTwoLevels) value = c < shape.columns() / 2 ? 10 : 11;
      const bool is_void = is_void_there(kind, c, r, static_cast<std::uint32_t>(random()));
      if (type == CodeType::kF32) {
        if (kind == Kind::kNoise) value = std::bit_cast<float>(noise);
        if (kind == Kind::kExtremes)
          value = noise % 2 == 0 ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
        if (kind == Kind::kTwoLevels) value = noise % 2 == 0 ? -0.0 : 0.0;
        if (kind == Kind::kVoidNoise) value *= 0.37;
        tile.heights.push_back(is_void ? std::numeric_limits<float>::quiet_NaN() : static_cast<float>(value));
      } else {
        const double limited =
            std::min(type == CodeType::kU8 ? std::fmod(value, 255.0) : value, static_cast<double>(most));
        tile.codes.push_back(is_void ? static_cast<std::uint16_t>(quantisation.void_code())
                                     : static_cast<std::uint16_t>(limited));
      }
    }
  }
  return tile;
}

std::vector<std::byte> payload_of(const EncodedTile& tile) {
  std::vector<std::byte> payload(tile.payload_bytes);
  inflate_exactly(tile.deflated, payload);
  return payload;
}

TileGrid small_grid() {
  return TileGrid::make(TileShape::make(12, 11, 3), 5, 4, 100.0, 100.0);
}

bool same_samples(const TileCodes& a, const TileCodes& b) {
  if (a.type != b.type || a.codes != b.codes || a.heights.size() != b.heights.size()) return false;
  for (std::size_t i = 0; i < a.heights.size(); ++i) {
    const bool both_void = std::isnan(a.heights[i]) && std::isnan(b.heights[i]);
    if (!both_void && std::bit_cast<std::uint32_t>(a.heights[i]) != std::bit_cast<std::uint32_t>(b.heights[i]))
      return false;
  }
  return true;
}

Metadata make_metadata(const TileGrid& grid, CodeType type) {
  Metadata metadata(grid);
  metadata.quantisation = {type, type == CodeType::kF32 ? 0.0 : -12.5, type == CodeType::kF32 ? 1.0 : 0.1};
  metadata.horizontal_unit = "metre";
  metadata.vertical_unit = "metre";
  metadata.valid = {0.0, grid.world_height() / 5.0, grid.world_width() / 3.0, grid.world_height()};
  metadata.source.name = "hügel \"1\".tif";
  metadata.source.format = "GeoTIFF";
  metadata.source.width = 1201;
  metadata.source.height = 1200;
  metadata.source.spacing_x = grid.world_width() / 1200.0;
  metadata.source.spacing_z = grid.world_height() / 1200.0;
  metadata.source.sample_type = "int16";
  metadata.source.registration = Registration::kPoint;
  metadata.source.origin_x = 6.000123456789;
  metadata.source.crs_epsg = 32611;
  metadata.source.crs_wkt = "PROJCS[\"...\"]";
  metadata.statistics.min = -12.5;
  metadata.statistics.mean = 0.1;
  metadata.statistics.vertices = 1234567890123;
  metadata.textures = {"textures/0.png"};
  metadata.producer = "isohf 0.1.0";
  return metadata;
}

TileCodes tile_of_archive(const TileGrid& grid, CodeType type, std::int64_t flat) {
  const auto kind = kAllKinds[static_cast<std::size_t>(flat) % std::size(kAllKinds)];
  return make_tile(grid.shape(), type, kind, static_cast<std::uint32_t>(flat) + 1);
}

void make_archive(const std::string& path, const TileGrid& grid, CodeType type) {
  ArchiveWriter writer(path, grid, WriterOptions{});
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    writer.add_tile(encode_tile(grid.shape(), tile_of_archive(grid, type, flat)));
  }
  const std::vector<std::byte> seeds(1000, std::byte{7});
  writer.add_member("shadow/seeds.bin", seeds, true);
  writer.add_member("preview.png", std::vector<std::byte>(33, std::byte{9}), false);
  static_cast<void>(writer.finish(make_metadata(grid, type)));
}

}  // namespace isohf::test
