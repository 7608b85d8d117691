#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "formats/raw_file.h"

namespace isohf {

/// One file of a zip archive (PKWARE APPNOTE 6.3, Zip64 included).
struct ZipMember {
  std::string name;
  std::uint16_t method = 0;  ///< 0 stored, 8 deflated
  bool encrypted = false;
  std::uint32_t crc32 = 0;
  std::uint64_t stored_bytes = 0;
  std::uint64_t size_bytes = 0;
  std::uint64_t header_offset_bytes = 0;
};

/// The directory of the archive. Throws Error{kCorrupt, kIo} naming the file.
[[nodiscard]] std::vector<ZipMember> zip_members(const RawFile& file);

/// Where the stored bytes of `member` begin in the file. Throws Error: kUnsupported for encrypted members and for
/// methods other than stored and deflated; kCorrupt.
[[nodiscard]] std::uint64_t zip_member_begin(const RawFile& file, const ZipMember& member);

}  // namespace isohf
