#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/lattice.h"

/// The ZIP records that an archive is made of (PKWARE APPNOTE; docs/archive_format.md has the profile): writing ours
/// and reading anybody's.

namespace isohf {

inline constexpr const char* kMetadataName = "isohf.json";
inline constexpr const char* kIndexName = "index.bin";

enum class ZipMethod : std::uint16_t { kStored = 0, kDeflated = 8 };

/// A member as local header and directory describe it.
struct ZipMember {
  std::string name;
  ZipMethod method = ZipMethod::kStored;
  std::uint32_t crc32 = 0;
  std::uint64_t compressed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint64_t header_offset = 0;  ///< of the local header
};

/// "tiles/ROW/COLUMN.tile", decimal, without leading zeros.
[[nodiscard]] std::string tile_name(TileIndex tile);
/// The tile of such a name; nullopt where it is none in exactly that form.
[[nodiscard]] std::optional<TileIndex> tile_from_name(std::string_view name);

/// Why a name may not stand in an archive, one clause; empty where it may.
[[nodiscard]] std::string why_bad_name(std::string_view name);

// --- writing ---

void append_local_header(const ZipMember& member, std::vector<std::byte>& out);
[[nodiscard]] std::uint64_t local_header_bytes(const ZipMember& member);
void append_directory_entry(const ZipMember& member, std::vector<std::byte>& out);
/// ZIP64 end record, its locator, and the end record.
void append_end_records(std::uint64_t entries, std::uint64_t directory_offset, std::uint64_t directory_bytes,
                        std::vector<std::byte>& out);

// --- reading; everything throws Error{kCorrupt, kUnsupported} naming byte offsets ---

struct ZipEnd {
  std::uint64_t entries = 0;
  std::uint64_t directory_offset = 0;
  std::uint64_t directory_bytes = 0;
  std::uint64_t records_offset = 0;  ///< where the end records begin: the first byte behind the directory
};

[[nodiscard]] ZipEnd find_zip_end(std::span<const std::byte> file);

/// One entry of the directory; `name` points into the file.
struct ZipEntry {
  std::string_view name;
  std::uint16_t flags = 0;
  std::uint16_t method = 0;
  std::uint32_t crc32 = 0;
  std::uint64_t compressed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint64_t header_offset = 0;
  std::uint64_t entry_offset = 0;  ///< where the entry itself stands
};

/// Calls `at` for every entry, in order; checks that they fill the directory.
void for_each_entry(std::span<const std::byte> file, const ZipEnd& end, const std::function<void(const ZipEntry&)>& at);

/// The directory's first entry; there must be one.
[[nodiscard]] ZipEntry first_entry(std::span<const std::byte> file, const ZipEnd& end);

/// Offset of a member's data: reads its local header and compares it with what the directory says.
[[nodiscard]] std::uint64_t checked_data_offset(std::span<const std::byte> file, const ZipEntry& entry);

}  // namespace isohf
