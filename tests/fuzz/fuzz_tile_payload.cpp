// Any bytes are a tile payload or an error, for every sample type and both versions. The first byte chooses shape and type.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <span>
#include <vector>

#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/error.h"

namespace {

using Decode = isohf::TileCodes (*)(const isohf::TileShape&, isohf::CodeType, std::span<const std::byte>);

/// The digest of the tile, or nothing where it is refused.
std::optional<isohf::Digest> digest_by(Decode decode, const isohf::TileShape& shape, isohf::CodeType type,
                                       std::span<const std::byte> payload) {
  try {
    return tile_content_digest(decode(shape, type, payload));
  } catch (const isohf::Error&) {
    return std::nullopt;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using isohf::CodeType;
  if (size == 0) return 0;
  static const isohf::TileShape shapes[] = {isohf::TileShape::make(5, 5, 1), isohf::TileShape::make(12, 11, 3),
                                            isohf::TileShape::make(68, 67, 1)};
  const CodeType types[] = {CodeType::kU16, CodeType::kU8, CodeType::kF32};
  const isohf::TileShape& shape = shapes[data[0] % 3];
  const CodeType type = types[data[0] / 3 % 3];
  const auto payload = std::as_bytes(std::span<const std::uint8_t>(data, size)).subspan(1);
  if (digest_by(isohf::decode_tile, shape, type, payload) !=
      digest_by(isohf::decode_tile_slowly, shape, type, payload)) {
    std::abort();
  }
  try {
    const isohf::TileCodes tile = decode_tile(shape, type, payload);
    // What is read can be written, and reads back the same.
    const isohf::EncodedTile encoded =
        encode_tile(shape, tile, isohf::Effort::kDefault, isohf::PayloadVersion::kAdaptive);
    if (!encoded.is_empty) {
      std::vector<std::byte> written(encoded.payload_bytes);
      isohf::inflate_exactly(encoded.deflated, written);
      if (digest_by(isohf::decode_tile, shape, type, written) != encoded.content_digest) std::abort();
    }
  } catch (const isohf::Error&) {
  }
  return 0;
}
