#include <webp/decode.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "formats/io/text.h"
#include "formats/png/png_decoder.h"
#include "formats/readers.h"

namespace isohf {
namespace {

const std::uint8_t* bytes_of(std::span<const std::byte> stored) {
  return reinterpret_cast<const std::uint8_t*>(stored.data());
}

}  // namespace

bool WebpDecoder::open(const std::string& path, PngHeader& header) {
  is_open_ = false;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) return fail(std::strerror(error ? error.value() : errno));
  file_.resize(static_cast<std::size_t>(std::min<std::uintmax_t>(size, kMaxInterlacedBytes)));
  in.read(reinterpret_cast<char*>(file_.data()), static_cast<std::streamsize>(file_.size()));
  file_.resize(static_cast<std::size_t>(in.gcount()));
  return open(std::span<const std::byte>(file_), header);
}

bool WebpDecoder::open(std::span<const std::byte> stored, PngHeader& header) {
  stored_ = stored;
  is_open_ = true;
  WebPBitstreamFeatures found{};
  const VP8StatusCode status = WebPGetFeatures(bytes_of(stored), stored.size(), &found);
  if (status == VP8_STATUS_NOT_ENOUGH_DATA) return fail("ends early");
  if (status != VP8_STATUS_OK) return fail("is damaged");
  if (found.has_animation != 0) return fail("is an animation");
  constexpr int kLossless = 2;
  header = {};
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
  if (decode(bytes_of(stored_), stored_.size(), out, picture.size(), static_cast<int>(header.row_bytes)) == nullptr)
    return fail("is damaged or cut off");
  return true;
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
