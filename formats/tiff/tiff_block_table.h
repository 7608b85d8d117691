#pragma once

#include <cstdint>

#include "formats/files/raw_file.h"
#include "formats/tiff/tiff_file.h"
#include "formats/tiff/tiff_layout.h"

namespace isohf {

/// The blocks of one sample plane of an image, as its tables list them.
struct TiffBlockTable {
  std::uint64_t count = 0;
  std::uint64_t missing = 0;               ///< not stored (sparse file)
  std::uint64_t block_bytes = 0;           ///< of a whole block, decoded
  std::uint64_t largest_stored_bytes = 0;  ///< of a block in the file
};

/// Checks, before anything is allocated, that all blocks lie in the file and can hold what the layout says.
/// plane  of blocks, 0 where samples are interleaved
/// Throws Error{kCorrupt}: blocks outside of the file, too short for their samples, absurdly large, or too few.
[[nodiscard]] TiffBlockTable check_tiff_blocks(const RawFile& file, const TiffLayout& layout, std::int64_t plane,
                                               TiffHandle& handle);

}  // namespace isohf
