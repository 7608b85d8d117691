// Any bytes are shadow seeds of a tile, or an error; those that were read are coded and read back the same. The first byte
// chooses type, shape and the tile's place.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"
#include "isohf/error.h"

namespace {

std::vector<std::byte> inflated(const isohf::EncodedSeeds& seeds) {
  std::vector<std::byte> bytes(seeds.payload_bytes);
  isohf::inflate_exactly(seeds.deflated, bytes);
  return bytes;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using isohf::CodeType;
  if (size == 0) return 0;
  constexpr std::array kTypes = {CodeType::kU16, CodeType::kU8, CodeType::kF32};
  const CodeType type = kTypes[data[0] % 3];
  const isohf::TileShape shape =
      data[0] / 3 % 2 == 0 ? isohf::TileShape::make(5, 5, 1) : isohf::TileShape::make(12, 11, 2);
  const isohf::TileGrid grid = isohf::TileGrid::make(shape, 6, 2, 100.0, 100.0);
  const isohf::TileIndex index{data[0] / 6 % 6, 1};
  const auto payload = std::as_bytes(std::span<const std::uint8_t>(data, size)).subspan(1);
  isohf::TileEdges edges{type, {}, {}};
  for (int row = 0; row < isohf::visible_rows(shape); ++row) {
    edges.west.push_back(row % 5 == 3 ? NAN : 20.0 + row);
    edges.east.push_back(row % 4 == 2 ? NAN : 90.0 - row);
  }
  try {
    const isohf::HullSeeds seeds = decode_hull_seeds(grid, index, edges, payload);
    const isohf::HullSeeds again = decode_hull_seeds(grid, index, edges, inflated(encode_seeds(grid, edges, seeds)));
    if (!(again.eastward == seeds.eastward && again.westward == seeds.westward)) std::abort();
  } catch (const isohf::Error&) {
  }
  return 0;
}
