#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "isohf/picture.h"

namespace isohf {

/// A picture as PNG (8 bits a channel, sRGB) or JPEG (baseline, 4:4:4, without EXIF; 1 or 3 channels), and back. The
/// same picture gives the same bytes, with the same libpng and libjpeg.
/// quality  1...100
/// Throws Error{kOutOfMemory}.
[[nodiscard]] std::vector<std::byte> encode_png(const Picture& picture);
[[nodiscard]] std::vector<std::byte> encode_jpeg(const Picture& picture, int quality);

/// Decodes a picture of at most `most` pixels in either direction. Throws Error{kCorrupt}, also for what a laxer
/// decoder would make up; kUnsupported for other than 1, 3 or 4 channels of 8 bits.
[[nodiscard]] Picture decode_png(std::span<const std::byte> bytes, int most);
[[nodiscard]] Picture decode_jpeg(std::span<const std::byte> bytes, int most);

}  // namespace isohf
