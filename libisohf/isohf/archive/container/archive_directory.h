#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/base/zip.h"
#include "isohf/byte_source.h"
#include "isohf/lattice.h"

/// An archive as a ZIP file: its members' names, and its directory held against the rules of docs/archive_format.md.

namespace isohf {

inline constexpr const char* kMetadataName = "isohf.json";
inline constexpr const char* kIndexName = "index.bin";

/// "tiles/ROW/COLUMN.tile", decimal, without leading zeros.
[[nodiscard]] std::string tile_name(TileIndex tile);
/// The tile of such a name; nullopt where it is none in exactly that form.
[[nodiscard]] std::optional<TileIndex> tile_from_name(std::string_view name);

/// Why a name may not stand in an archive, one clause; empty where it may.
[[nodiscard]] std::string why_bad_name(std::string_view name);

/// An archive's directory, read whole and checked: names, duplicates, local headers, overlaps.
struct ArchiveDirectory {
  struct Tile {
    std::int64_t flat;
    ZipEntry entry;
    std::uint64_t data_offset;
  };
  struct Member {
    ZipEntry entry;
    std::uint64_t data_offset;
  };

  std::vector<Tile> tiles;      ///< by flat index
  std::vector<Member> members;  ///< the others, in file order
};

/// What a check hands its findings to, as text. It may throw, or take note and return.
using Complain = std::function<void(const std::string&)>;

/// The end record of an archive. Throws Error{kCorrupt} where there is none or it contradicts the file.
[[nodiscard]] ZipEnd find_archive_end(const ByteSource& file);

/// Reads and checks the directory of a file whose tiles belong to `grid`; with nullopt the members alone, and what is
/// in tiles/ goes unread. What is wrong goes to `complain`; the entry at fault is left out.
[[nodiscard]] ArchiveDirectory read_directory(const ByteSource& file, const ZipEnd& end,
                                              const std::optional<TileGrid>& grid, const Complain& complain);

/// Holds an archive of ours against the profile beyond what makes a ZIP file: the directory in file order and as the
/// writer makes it, members back to back from byte 0 on, metadata first, index last and right before the directory.
void check_profile(const ByteSource& file, const ZipEnd& end, const Complain& complain);

/// Offset of a member's data, its local header held against the directory. Throws Error{kCorrupt, kUnsupported}.
[[nodiscard]] std::uint64_t checked_data_offset(const ByteSource& file, const ZipEntry& entry);

/// A member whose data stand at `data_offset`, inflated where they are deflated, the CRC checked. Throws Error{kCorrupt,
/// kUnsupported, kIo}.
[[nodiscard]] std::vector<std::byte> member_from(const ByteSource& file, const ZipEntry& entry,
                                                 std::uint64_t data_offset);

/// CRC-32 of a range, read in pieces.
[[nodiscard]] std::uint32_t crc32_in(const ByteSource& file, std::uint64_t offset_bytes, std::uint64_t size_bytes);

/// CRC-32 over the CRC-32s of all members' data as they stand in the file, in the directory's order, but those of the
/// metadata and the index. Throws as reading does.
[[nodiscard]] std::uint32_t data_crc32(const ByteSource& file);
/// The metadata's extension that holds it, as a string of hexadecimal digits.
inline constexpr const char* kDataCrcName = "data_crc32";

/// "member "a/b" at byte 4711".
[[nodiscard]] std::string describe(const ZipEntry& entry);

}  // namespace isohf
