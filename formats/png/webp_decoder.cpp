#include <webp/decode.h>

#include <algorithm>
#include <string>

#include "formats/png/png_decoder.h"
#include "formats/readers.h"
#include "isohf/base/text/text.h"

namespace isohf {

bool WebpDecoder::read_header(PngHeader& header) {
  std::fseek(file(), 0, SEEK_END);
  const std::int64_t size = std::ftell(file());
  std::rewind(file());
  stored_.resize(static_cast<std::size_t>(std::clamp<std::int64_t>(size, 0, kMaxInterlacedBytes)));
  stored_.resize(std::fread(stored_.data(), 1, stored_.size(), file()));
  WebPBitstreamFeatures found{};
  const VP8StatusCode status = WebPGetFeatures(stored_.data(), stored_.size(), &found);
  if (status == VP8_STATUS_NOT_ENOUGH_DATA) return fail("ends early");
  if (status != VP8_STATUS_OK) return fail("is damaged");
  if (found.has_animation != 0) return fail("is an animation");
  constexpr int kLossless = 2;
  header.width = static_cast<std::uint32_t>(found.width);
  header.height = static_cast<std::uint32_t>(found.height);
  header.bit_depth = 8;
  header.interlaced = true;
  header.is_lossy = found.format != kLossless;
  header.channels = {"R", "G", "B"};
  if (found.has_alpha != 0) header.channels.push_back("A");
  header.row_bytes = std::size_t{header.width} * header.channels.size();
  return true;
}

bool WebpDecoder::read_picture(std::span<std::byte> picture, const PngHeader& header) {
  auto* const out = reinterpret_cast<std::uint8_t*>(picture.data());
  const auto decode = header.channels.size() == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
  const auto row_bytes = static_cast<int>(header.row_bytes);
  return decode(stored_.data(), stored_.size(), out, picture.size(), row_bytes) != nullptr ||
         fail("is damaged or cut off");
}

bool looks_like_webp(std::span<const std::byte> head) {
  return text_of(head).starts_with("RIFF") &&
         text_of(head).substr(std::min<std::size_t>(8, head.size())).starts_with("WEBP");
}

std::string webp_library() {
  const int version = WebPGetDecoderVersion();
  return "libwebp " + std::to_string(version >> 16) + '.' + std::to_string(version >> 8 & 0xFF) + '.' +
         std::to_string(version & 0xFF);
}

}  // namespace isohf
