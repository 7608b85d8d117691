#include "isohf/archive/tile_codec.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>

#include "archive/tiles.h"
#include "isohf/archive/content_hash.h"
#include "isohf/archive/deflate.h"
#include "isohf/archive/tile_payload.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

using test::Kind;

constexpr CodeType kAllTypes[] = {CodeType::kU16, CodeType::kU8, CodeType::kF32};

std::vector<TileShape> shapes() {
  return {TileShape::make(5, 5, 1),   TileShape::make(6, 5, 1),   TileShape::make(5, 7, 1),  TileShape::make(12, 11, 3),
          TileShape::make(24, 29, 1), TileShape::make(52, 67, 4), TileShape::make(300, 9, 1)};
}

std::vector<std::byte> payload_of(const EncodedTile& tile) {
  std::vector<std::byte> payload(tile.payload_bytes);
  inflate_exactly(tile.deflated, payload);
  return payload;
}

/// What zlib, which knows nothing of us, makes of the stream.
std::vector<std::byte> inflate_with_zlib(const EncodedTile& tile) {
  std::vector<std::byte> out(tile.payload_bytes + 1);
  z_stream stream{};
  stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(tile.deflated.data()));
  stream.avail_in = static_cast<uInt>(tile.deflated.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  EXPECT_EQ(inflateInit2(&stream, -MAX_WBITS), Z_OK);
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END) << (stream.msg == nullptr ? "" : stream.msg);
  EXPECT_EQ(stream.avail_in, 0U);
  out.resize(stream.total_out);
  inflateEnd(&stream);
  return out;
}

TEST(TileCodec, BringsBackEverySampleOfEveryKindOfTile) {
  for (const TileShape& shape : shapes()) {
    for (const CodeType type : kAllTypes) {
      for (const Kind kind : test::kAllKinds) {
        for (std::uint32_t seed = 1; seed <= 3; ++seed) {
          SCOPED_TRACE(::testing::Message() << shape.columns() << "x" << shape.rows() << " " << to_string(type)
                                            << " kind " << static_cast<int>(kind) << " seed " << seed);
          const TileCodes tile = test::make_tile(shape, type, kind, seed);
          const EncodedTile encoded = encode_tile(shape, tile);
          EXPECT_EQ(encoded.content_digest, tile_content_digest(tile));
          ASSERT_EQ(encoded.is_empty, kind == Kind::kAllVoid);
          if (encoded.is_empty) continue;
          const std::vector<std::byte> payload = payload_of(encoded);
          EXPECT_EQ(payload, inflate_with_zlib(encoded));
          EXPECT_EQ(crc32(payload), encoded.payload_crc32);
          EXPECT_LE(payload.size(), max_payload_bytes(shape, type));
          ASSERT_TRUE(test::same_samples(decode_tile(shape, type, payload), tile));
        }
      }
    }
  }
}

}  // namespace
}  // namespace isohf
