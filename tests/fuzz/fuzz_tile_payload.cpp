// Any bytes are a tile payload or an error, for every sample type. The first byte chooses shape and type.

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "isohf/archive/codec/simd/batch_decoder.h"
#include "isohf/archive/codec/tile_decoder.h"
#include "isohf/archive/codec/tile_encoder.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using isohf::CodeType;
  if (size == 0) return 0;
  // The last one is large enough for several blocks of predictors.
  static const isohf::TileShape shapes[] = {isohf::TileShape::make(5, 5, 1), isohf::TileShape::make(12, 11, 3),
                                            isohf::TileShape::make(68, 67, 1)};
  const CodeType types[] = {CodeType::kU16, CodeType::kU8, CodeType::kF32};
  const isohf::TileShape& shape = shapes[data[0] % 3];
  const CodeType type = types[data[0] / 3 % 3];
  const auto payload = std::as_bytes(std::span<const std::uint8_t>(data, size)).subspan(1);
  // Side by side it is decoded to the same, or not.
  const std::array<std::span<const std::byte>, 2> twice = {payload, payload};
  std::array<isohf::TileCodes, 2> lanes;
  std::array<bool, 2> is_decoded{};
  decode_batch(shape, type, twice, lanes, is_decoded);
  if (is_decoded[0] != is_decoded[1]) std::abort();
  try {
    const isohf::TileCodes tile = decode_tile(shape, type, payload);
    // What is read can be written, and reads back the same.
    const isohf::EncodedTile encoded = encode_tile(shape, tile);
    if (encoded.content_digest.size() != 32) std::abort();
    for (const isohf::TileCodes& lane : lanes) {
      if (is_decoded[0] && tile_content_digest(lane) != encoded.content_digest) std::abort();
    }
  } catch (const isohf::Error&) {
    if (is_decoded[0]) std::abort();
  }
  return 0;
}
