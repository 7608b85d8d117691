#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/base/zip.h"
#include "isohf/byte_source.h"
#include "isohf/lattice.h"
#include "isohf/metadata.h"

/// An archive as a ZIP file: its members' names, and its directory held against the rules of docs/archive_format.md.

namespace isohf {

inline constexpr const char* kMetadataName = "isohf.json";
inline constexpr const char* kIndexName = "index.bin";
/// The first member, stored, and what it holds.
inline constexpr const char* kMediaTypeName = "mimetype";
inline constexpr std::string_view kMediaType = "application/vnd.isohf+zip";

/// A tile of a plane; plane 0 are the tiles themselves.
struct PlaneTile {
  int plane = 0;
  TileIndex tile{};
  friend bool operator==(const PlaneTile&, const PlaneTile&) = default;
};
/// "tiles/ROW/COLUMN.tile", and "planes/PLANE/ROW/COLUMN.tile" on a coarse plane; decimal, without leading zeros.
[[nodiscard]] std::string tile_name(TileIndex tile, int plane = 0);
/// The tile of such a name; nullopt where it is none in exactly that form.
[[nodiscard]] std::optional<PlaneTile> tile_from_name(std::string_view name);
/// Whether the name stands in the folder of the tiles or of the planes, where nothing else may.
[[nodiscard]] bool is_in_tile_folder(std::string_view name);
/// The metadata's grids by plane.
[[nodiscard]] std::vector<TileGrid> plane_grids(const Metadata& metadata);

/// Why a name may not stand in an archive, one clause; empty where it may.
[[nodiscard]] std::string why_bad_name(std::string_view name);

/// An archive's directory, read whole and checked: names, duplicates, local headers, overlaps.
struct ArchiveDirectory {
  struct Tile {
    int plane;
    std::int64_t flat;
    ZipEntry entry;
    std::uint64_t data_offset;
  };
  struct Member {
    ZipEntry entry;
    std::uint64_t data_offset;
  };

  std::vector<Tile> tiles;      ///< by plane and flat index
  std::vector<Member> members;  ///< the others, in file order
};

/// What a check hands its findings to, as text. It may throw, or take note and return.
using Complain = std::function<void(const std::string&)>;

/// The end record of an archive. Throws Error{kCorrupt} where there is none or it contradicts the file.
[[nodiscard]] ZipEnd find_archive_end(const ByteSource& file);

/// Reads and checks the directory of a file whose tiles belong to `grids`, by plane; with none the members alone, and
/// tiles go unread. What is wrong goes to `complain`; the entry at fault is left out.
[[nodiscard]] ArchiveDirectory read_directory(const ByteSource& file, const ZipEnd& end,
                                              std::span<const TileGrid> grids, const Complain& complain);

/// Holds an archive of ours against the profile beyond what makes a ZIP file: the directory in file order and as the
/// writer makes it, members back to back from byte 0 on, the media type first, index and metadata last.
void check_profile(const ByteSource& file, const ZipEnd& end, const Complain& complain);

/// The entries of index and metadata, by which an archive is opened.
struct OwnEntries {
  std::optional<ZipEntry> index;
  ZipEntry metadata;
  bool are_last = false;  ///< as a writer leaves them; else the directory was searched
};
/// Looks at the directory's end, or else goes through it. Throws Error{kCorrupt} where there are no metadata.
[[nodiscard]] OwnEntries find_own_entries(const ByteSource& file, const ZipEnd& end);

/// Offset of a member's data, its local header held against the directory. Throws Error{kCorrupt, kUnsupported}.
[[nodiscard]] std::uint64_t checked_data_offset(const ByteSource& file, const ZipEntry& entry);

/// A member whose data stand at `data_offset`, inflated where they are deflated, the CRC checked. Throws Error{kCorrupt,
/// kUnsupported, kIo}.
[[nodiscard]] std::vector<std::byte> member_from(const ByteSource& file, const ZipEntry& entry,
                                                 std::uint64_t data_offset);
/// The same of its data.
[[nodiscard]] std::vector<std::byte> member_from(std::span<const std::byte> data, const ZipEntry& entry);
/// A deflated member may claim a thousand times the bytes that it has: one that claims more than this is looked through
/// in pieces.
inline constexpr std::uint64_t kInflatedAtOnceBytes = std::uint64_t{16} << 20U;
/// Checks what member_from checks.
void check_member(const ByteSource& file, const ZipEntry& entry, std::uint64_t data_offset);

/// CRC-32 over the CRC-32s of the data of all members before the index as they stand in the file, in the directory's
/// order, but those of the metadata. Throws as reading does, with the name.
[[nodiscard]] std::uint32_t data_crc32(const ByteSource& file, const std::string& name);
/// The metadata's extension that holds it, as a string of hexadecimal digits.
inline constexpr const char* kDataCrcName = "data_crc32";

/// "member "a/b" at byte 4711".
[[nodiscard]] std::string describe(const ZipEntry& entry);

}  // namespace isohf
