#include "gl/png_file.h"

#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

#include "isohf/error.h"

namespace isohf::view {

void write_png(const std::string& path, int width, int height, std::span<const std::uint8_t> rgba) {
  std::vector<std::uint8_t> rgb;
  rgb.reserve(rgba.size() / 4 * 3);
  for (std::size_t i = 0; i + 3 < rgba.size(); i += 4) rgb.insert(rgb.end(), {rgba[i], rgba[i + 1], rgba[i + 2]});
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(width);
  image.height = static_cast<png_uint_32>(height);
  image.format = PNG_FORMAT_RGB;
  const std::string part = path + ".part";
  errno = 0;
  if (png_image_write_to_file(&image, part.c_str(), 0, rgb.data(), 0, nullptr) == 0 ||
      std::rename(part.c_str(), path.c_str()) != 0) {
    const std::string reason = errno != 0 ? std::strerror(errno) : image.message;
    png_image_free(&image);
    std::remove(part.c_str());
    throw Error(ErrorCode::kIo, path + ": could not be written: " + reason);
  }
}

}  // namespace isohf::view
