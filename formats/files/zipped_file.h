#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/files/raw_file.h"

namespace isohf {

/// One file of a zip archive (PKWARE APPNOTE 6.3, Zip64 included).
struct ZippedFile {
  std::string name;
  std::uint16_t method = 0;  ///< 0 stored, 8 deflated
  bool encrypted = false;
  std::uint32_t crc32 = 0;
  std::uint64_t stored_bytes = 0;
  std::uint64_t size_bytes = 0;
  std::uint64_t header_offset_bytes = 0;
};

/// The directory of the archive. Throws Error{kCorrupt, kIo} naming the file.
[[nodiscard]] std::vector<ZippedFile> zipped_files(const RawFile& file);

/// Where the stored bytes of `member` begin in the file. Throws Error: kUnsupported for encrypted members and for
/// methods other than stored and deflated; kCorrupt.
[[nodiscard]] std::uint64_t zipped_file_begin(const RawFile& file, const ZippedFile& member);

}  // namespace isohf
