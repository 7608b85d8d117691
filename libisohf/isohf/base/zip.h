#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/byte_source.h"

/// The records of a ZIP file (PKWARE APPNOTE 6.3, ZIP64 included): reads anybody's, and writes them as
/// docs/archive_format.md has them. Everything that reads throws Error{kCorrupt} naming byte offsets.

namespace isohf {

enum class ZipMethod : std::uint16_t { kStored = 0, kDeflated = 8 };  ///< others are read, but not made

/// A member as local header and directory describe it.
struct ZipMember {
  std::string name;
  ZipMethod method = ZipMethod::kStored;
  std::uint32_t crc32 = 0;
  std::uint64_t compressed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint64_t header_offset = 0;  ///< of the local header
};

/// An entry of the directory.
struct ZipEntry : ZipMember {
  bool is_encrypted = false;
  std::uint64_t entry_offset = 0;  ///< where the entry itself stands
};

/// Where the directory is.
struct ZipEnd {
  std::uint64_t entries = 0;
  std::uint64_t directory_offset = 0;
  std::uint64_t directory_bytes = 0;
  std::uint64_t records_offset = 0;  ///< the first byte of the end records
  std::uint64_t end_offset = 0;      ///< the first byte behind them and their comment
};

/// The end record, looked for in the last 64 KiB: the last one that ends with the file, or else the last one; nullopt
/// where there is none.
[[nodiscard]] std::optional<ZipEnd> find_zip_end(const ByteSource& file);

/// Goes through a directory in pieces of it: `for (ZipEntries all(file, end); const auto entry = all.next();)`.
class ZipEntries {
 public:
  ZipEntries(const ByteSource& file, const ZipEnd& end) : file_(file), end_(end) {}

  /// nullopt behind the last one; checks that there are as many as the end record says.
  [[nodiscard]] std::optional<ZipEntry> next() {
    ZipEntry entry;
    return read(entry) ? std::optional(std::move(entry)) : std::nullopt;
  }
  /// The same into an entry that was used before; false behind the last one.
  [[nodiscard]] bool read(ZipEntry& entry);

 private:
  const ByteSource& file_;
  ZipEnd end_;
  std::vector<std::byte> piece_;    ///< of the directory
  std::uint64_t piece_offset_ = 0;  ///< in the directory
  std::uint64_t position_ = 0;      ///< of the next entry, likewise
  std::uint64_t entries_ = 0;
};

/// A local header.
struct ZipLocal {
  ZipMember member;
  bool sizes_follow = false;      ///< CRC and sizes stand behind the data: zeros here
  std::uint64_t data_offset = 0;  ///< the entry's data lie within the file
};
[[nodiscard]] ZipLocal read_local_header(const ByteSource& file, const ZipEntry& entry);

void append_local_header(const ZipMember& member, std::vector<std::byte>& out);
[[nodiscard]] std::uint64_t local_header_bytes(const ZipMember& member);
void append_directory_entry(const ZipMember& member, std::vector<std::byte>& out);
/// ZIP64 end record, its locator, and the end record.
void append_end_records(std::uint64_t entries, std::uint64_t directory_offset, std::uint64_t directory_bytes,
                        std::vector<std::byte>& out);

}  // namespace isohf
