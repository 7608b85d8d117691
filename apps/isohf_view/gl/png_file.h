#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace isohf::view {

/// Writes rows of RGBA bytes, from the top, as an opaque RGB PNG file. Throws Error{kIo} naming the path.
void write_png(const std::string& path, int width, int height, std::span<const std::uint8_t> rgba);

}  // namespace isohf::view
