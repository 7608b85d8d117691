#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/container/zip_layout.h"
#include "isohf/base/file.h"

namespace isohf {

/// A ZIP directory, read whole and checked: names, duplicates, local headers, overlaps.
struct Directory {
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
  std::uint64_t data_end = 0;   ///< first byte behind the last member
};

/// What a check hands its findings to: a finding's text. It may throw, or take note and return.
using Complain = std::function<void(const std::string&)>;

/// Reads and checks the directory of a file whose tiles belong to `grid`; with nullopt the members alone, and what is
/// in tiles/ goes unread. What is wrong goes to `complain`; the entry at fault is left out.
[[nodiscard]] Directory read_directory(std::span<const std::byte> file, const ZipEnd& end,
                                       const std::optional<TileGrid>& grid, const Complain& complain);

/// Holds an archive of ours against the profile beyond what makes a ZIP file: the directory in file order and as the
/// writer makes it, members back to back from byte 0 on, metadata first, index last and right before the directory.
void check_profile(std::span<const std::byte> file, const ZipEnd& end, const Complain& complain);

/// CRC-32 over the CRC-32s of all members' data as they stand in the file, in the directory's order, but those of the
/// metadata and the index. Throws as reading does.
[[nodiscard]] std::uint32_t data_crc32(const MappedFile& file, const ZipEnd& end);

/// A member whose data stand at `data_offset`, inflated where they are deflated, the CRC checked. Not through the map:
/// a file that was cut after it was opened is an error, not the end of the process. Throws Error{kCorrupt,
/// kUnsupported, kIo}.
[[nodiscard]] std::vector<std::byte> member_from(const MappedFile& file, const ZipEntry& entry,
                                                 std::uint64_t data_offset);

/// "member "a/b" at byte 4711".
[[nodiscard]] std::string describe(const ZipEntry& entry);

}  // namespace isohf
