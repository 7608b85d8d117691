#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
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

/// An archive as a ZIP file: its members' names, and its directory compared with the rules of docs/archive_format.md.

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

/// What a check hands its findings to, as text. It may throw, or take note and return.
using Complain = std::function<void(const std::string&)>;

/// The end record of an archive. Throws Error{kCorrupt} where there is none or it contradicts the file.
[[nodiscard]] ZipEnd find_archive_end(const ByteSource& file);

/// Finds members of one name, and members that share bytes or reach into the directory. Memory: 32 bytes a member.
class MemberPlaces {
 public:
  void add(const ZipEntry& entry, std::uint64_t data_offset);
  /// Sorts what was added.
  void check(const ByteSource& file, const ZipEnd& end, const Complain& complain);

 private:
  struct Place {
    std::size_t name_hash;
    std::uint64_t begin;  ///< of the local header
    std::uint64_t end;    ///< of the data
    std::uint64_t entry_offset;
  };
  std::deque<Place> places_;  ///< which grows without a copy
};

/// Whether an entry is a folder's: archivers add such, and they hold nothing.
[[nodiscard]] bool is_folder(const ZipEntry& entry);
/// Why a member in the folder of tiles or planes cannot be a tile, one clause; empty where it can.
[[nodiscard]] std::string why_bad_tile(const ZipEntry& entry, std::span<const TileGrid> grids);
/// Offset of a member's data; nullopt when its name or its local header breaks a rule, which goes to `complain`.
[[nodiscard]] std::optional<std::uint64_t> check_entry(const ByteSource& file, const ZipEntry& entry,
                                                       const Complain& complain);

/// Goes through the directory in its order, and refuses what breaks a rule of docs/archive_format.md: names,
/// duplicates, local headers, overlaps. Tiles are visited, or passed by unread.
enum class Tiles { kVisited, kPassedBy };
void for_each_member(const ByteSource& file, const ZipEnd& end, Tiles tiles,
                     const std::function<void(const ZipEntry& entry, std::uint64_t data_offset)>& visit);

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
/// Checks what member_from checks, in pieces.
void check_member(const ByteSource& file, const ZipEntry& entry, std::uint64_t data_offset);

/// CRC-32 over the CRC-32s of the data of all members before the index as they stand in the file, in the directory's
/// order, but those of the metadata. Throws as reading does, with the name.
[[nodiscard]] std::uint32_t data_crc32(const ByteSource& file, const std::string& name);
/// The metadata's extension that holds it, as a string of hexadecimal digits.
inline constexpr const char* kDataCrcName = "data_crc32";

/// "member "a/b" at byte 4711".
[[nodiscard]] std::string describe(const ZipEntry& entry);

}  // namespace isohf
