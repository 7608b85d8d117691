// Any bytes are a picture of at most the stated size, or an error.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "isohf/archive/textures/picture_codec.h"
#include "isohf/error.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  constexpr int kMost = 64;
  const std::span bytes(reinterpret_cast<const std::byte*>(data), size);
  for (const auto decode : {isohf::decode_png, isohf::decode_jpeg}) {
    try {
      const isohf::Picture picture = decode(bytes, kMost);
      const std::size_t expected = picture.row_bytes() * static_cast<std::size_t>(picture.height);
      if (picture.width > kMost || picture.height > kMost || picture.samples.size() != expected) std::abort();
    } catch (const isohf::Error&) {
    }
  }
  return 0;
}
