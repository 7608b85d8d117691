#pragma once

#include <cstdint>
#include <optional>

#include "formats/files/raw_file.h"

namespace isohf {

/// Where a directory of a TIFF file lies, and how its numbers are written.
struct TiffDirectoryPlace {
  std::uint64_t offset_bytes = 0;
  bool big_tiff = false;  ///< numbers of 64 bits
  bool swapped = false;   ///< in big-endian order
};

/// The count of tag `wanted` in the directory as it stands in the file; nullopt where it is absent. libtiff pads short
/// tables with zeros, which would pass for blocks that a sparse file leaves out. Throws Error{kIo, kCorrupt}.
[[nodiscard]] std::optional<std::uint64_t> tiff_stored_count(const RawFile& file, const TiffDirectoryPlace& place,
                                                             std::uint16_t wanted);

}  // namespace isohf
