#include "formats/tiff/tiff_layout.h"

#include <tiff.h>

#include <algorithm>
#include <array>
#include <utility>

namespace isohf {

std::int64_t TiffLayout::stored_rows(std::int64_t down) const {
  return tiled ? block_height : std::min(block_height, height - down * block_height);
}

std::string tiff_compression_name(std::uint16_t compression) {
  constexpr std::array<std::pair<std::uint16_t, const char*>, 20> kNames = {{
      {COMPRESSION_NONE, "none"},
      {COMPRESSION_CCITTRLE, "CCITT RLE"},
      {COMPRESSION_CCITTFAX3, "CCITT fax 3"},
      {COMPRESSION_CCITTFAX4, "CCITT fax 4"},
      {COMPRESSION_LZW, "LZW"},
      {COMPRESSION_OJPEG, "old JPEG"},
      {COMPRESSION_JPEG, "JPEG"},
      {COMPRESSION_PACKBITS, "PackBits"},
      {COMPRESSION_PIXARLOG, "PixarLog"},
      {COMPRESSION_DEFLATE, "DEFLATE"},
      {COMPRESSION_ADOBE_DEFLATE, "DEFLATE"},
      {COMPRESSION_JBIG, "JBIG"},
      {COMPRESSION_SGILOG, "SGILog"},
      {COMPRESSION_JP2000, "JPEG 2000"},
      {COMPRESSION_LERC, "LERC"},
      {COMPRESSION_LZMA, "LZMA"},
      {COMPRESSION_ZSTD, "ZSTD"},
      {COMPRESSION_WEBP, "WebP"},
      {COMPRESSION_JXL, "JPEG XL"},
      {COMPRESSION_THUNDERSCAN, "ThunderScan"},
  }};
  for (const auto& [code, name] : kNames) {
    if (code == compression) return name;
  }
  return std::to_string(compression);
}

}  // namespace isohf
