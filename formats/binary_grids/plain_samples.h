#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "formats/files/raw_file.h"
#include "isohf/raster.h"

namespace isohf {

/// Where the samples of an uncompressed raster lie in its file: rows from North to South at equal distances.
struct PlainLayout {
  std::uint64_t offset_bytes = 0;  ///< of the first sample
  std::uint64_t row_bytes = 0;     ///< from a row's first sample to the next row's
  bool big_endian = false;
};

/// Reads `window` of the raster that `info` and `layout` describe, in host byte order. Throws Error{kIo, kCorrupt}.
void read_plain_samples(const RawFile& file, const SourceInfo& info, const PlainLayout& layout, const Window& window,
                        std::span<std::byte> samples);

}  // namespace isohf
