#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <memory>

#include "isohf/archive/textures/picture_codec.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

png_uint_32 format_of(int channels) {
  if (channels == 1) return PNG_FORMAT_GRAY;
  return channels == 3 ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
}

/// The header, which stands at the same bytes of every file.
struct Header {
  int depth;
  int type;
  int interlace;

  explicit Header(std::span<const std::byte> bytes)
      : depth(std::to_integer<int>(bytes[24])),
        type(std::to_integer<int>(bytes[25])),
        interlace(std::to_integer<int>(bytes[28])) {}

  /// 0 for those that are not read.
  [[nodiscard]] int channels() const {
    if (depth != 8 || interlace != 0) return 0;
    if (type == PNG_COLOR_TYPE_GRAY) return 1;
    return type == PNG_COLOR_TYPE_RGB ? 3 : type == PNG_COLOR_TYPE_RGB_ALPHA ? 4 : 0;
  }
};

/// libpng stops after the last row: whether the file ends as it must.
bool has_end(std::span<const std::byte> bytes) {
  constexpr std::array<unsigned char, 12> kEnd{0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};
  return bytes.size() >= kEnd.size() && std::ranges::equal(bytes.last(kEnd.size()), std::as_bytes(std::span(kEnd)));
}

}  // namespace

std::vector<std::byte> encode_png(const Picture& picture) {
  ISOHF_ASSERT(picture.channels == 1 || picture.channels == 3 || picture.channels == 4);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(picture.width);
  image.height = static_cast<png_uint_32>(picture.height);
  image.format = format_of(picture.channels);
  std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(image));
  png_alloc_size_t size = bytes.size();
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, picture.samples.data(), 0, nullptr) == 0)
    throw Error(ErrorCode::kOutOfMemory, fmt::format("libpng: {}", image.message));
  bytes.resize(size);
  return bytes;
}

Picture decode_png(std::span<const std::byte> bytes, int most) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  const std::unique_ptr<png_image, decltype(&png_image_free)> frees_itself(&image, &png_image_free);
  const auto require = [](bool holds, ErrorCode code, const std::string& why) {
    if (!holds) throw Error(code, "PNG: " + why);
  };
  // Warnings, where libpng would go on with what it made up, are errors as well.
  const auto is_well = [&](int result) { return result != 0 && image.warning_or_error == 0; };
  const int opened = png_image_begin_read_from_memory(&image, bytes.data(), bytes.size());
  require(is_well(opened), ErrorCode::kCorrupt, image.message);
  const auto limit = static_cast<png_uint_32>(most);
  require(image.width <= limit && image.height <= limit, ErrorCode::kCorrupt,
          fmt::format("{} x {} pixels, at most {} x {} are possible", image.width, image.height, most, most));
  const Header header(bytes);
  const int channels = header.channels();
  require(channels != 0 && image.format == format_of(channels), ErrorCode::kUnsupported,
          fmt::format("colour type {} of {} bits; 8-bit grey, RGB and RGBA without interlacing are read", header.type,
                      header.depth));
  Picture picture(static_cast<int>(image.width), static_cast<int>(image.height), channels);
  const int read = png_image_finish_read(&image, nullptr, picture.samples.data(), 0, nullptr);
  require(is_well(read), ErrorCode::kCorrupt, image.message);
  require(has_end(bytes), ErrorCode::kCorrupt, "does not end with its last chunk");
  return picture;
}

}  // namespace isohf
