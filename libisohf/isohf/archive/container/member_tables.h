#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/tile/tile_codes.h"

/// The member index.bin: tables of records in pages, their roots, the tables' descriptions, a footer
/// (docs/archive_format.md, "Index"). What stands here says how each of these reads in bytes.

namespace isohf {

inline constexpr std::size_t kRecordBytes = 32;
inline constexpr std::size_t kRootEntryBytes = 48;
inline constexpr std::size_t kTablesFooterBytes = 64;

/// A record of a table: a tile, or any other member, whose range is then 0.
struct TableRecord {
  TileEntry entry;
  bool deflated = true;
};

/// What a root says of a page; a page without a stored member has none, and its entry is all zeros.
struct RootEntry {
  std::uint64_t page_offset = 0;     ///< in index.bin
  std::uint64_t digests_offset = 0;  ///< likewise; 0 where the table has no digests
  std::uint64_t compressed_bytes = 0;
  std::uint32_t stored = 0;
  std::uint32_t page_crc32 = 0;
  std::uint32_t digests_crc32 = 0;
  std::uint32_t code_min = 0;
  std::uint32_t code_max = 0;
  bool has_voids = false;
};

/// A table's description.
struct TableDescription {
  MemberTable members;
  bool has_digests = false;
  std::uint32_t page_records = 0;
  std::uint64_t root_offset = 0;  ///< in index.bin
  std::uint32_t root_crc32 = 0;

  [[nodiscard]] std::uint64_t records() const {
    return static_cast<std::uint64_t>(members.columns) * static_cast<std::uint64_t>(members.rows);
  }
  [[nodiscard]] std::uint64_t pages() const { return (records() + page_records - 1) / page_records; }
  /// Records of a page: the last may have fewer.
  [[nodiscard]] std::uint64_t records_of(std::uint64_t page) const;
};

struct TablesFooter {
  std::uint32_t tables = 0;
  std::uint64_t index_bytes = 0;  ///< of all of index.bin
  std::uint64_t data_offset = 0;  ///< of index.bin's data in the file
  std::uint64_t members = 0;      ///< that stand before index.bin in the file
  std::uint64_t in_tables = 0;    ///< of these, in a table
  std::uint32_t descriptions_bytes = 0;
  std::uint32_t descriptions_crc32 = 0;
};

/// Records in a page of a table with so many.
[[nodiscard]] std::uint32_t page_records_for(std::uint64_t records);
/// Bytes of a page: a bit for each record, then those that are stored.
[[nodiscard]] std::uint64_t page_bytes(std::uint64_t records, std::uint32_t stored);

/// Tiles that a grid may have, of which so many are stored: whoever goes through a grid must come to an end.
[[nodiscard]] constexpr std::uint64_t most_tiles(std::uint64_t stored) {
  return (std::uint64_t{1} << 22U) + 1024 * stored;
}

/// How many of a page's records stand before the i-th, by its bits; nullopt where that one is not stored.
[[nodiscard]] std::optional<std::size_t> rank_in_page(std::span<const std::byte> bits, std::uint64_t i);

void append_record(const TableRecord& record, std::vector<std::byte>& out);
void append_root_entry(const RootEntry& entry, std::vector<std::byte>& out);
void append_description(const TableDescription& table, std::vector<std::byte>& out);
void append_tables_footer(const TablesFooter& footer, std::vector<std::byte>& out);

/// nullopt where a rule is broken.
[[nodiscard]] std::optional<TableRecord> parse_record(std::span<const std::byte> record);
[[nodiscard]] std::optional<RootEntry> parse_root_entry(std::span<const std::byte> entry);
[[nodiscard]] std::optional<std::vector<TableDescription>> parse_descriptions(std::span<const std::byte> bytes,
                                                                              std::uint32_t tables);
[[nodiscard]] std::optional<TablesFooter> parse_tables_footer(std::span<const std::byte> footer);

/// Codes and the bits of floats alike: a comes before b.
[[nodiscard]] bool code_less(std::uint32_t a, std::uint32_t b);
/// Widens a range by a tile's.
void widen(const TileEntry& tile, bool is_first, std::uint32_t& min, std::uint32_t& max);

// --- names ---

/// The table of a plane's tiles.
[[nodiscard]] std::string tile_table_name(int plane);

/// A member's place in a table.
struct TablePlace {
  std::string table;  ///< its name
  std::int64_t row = 0;
  std::int64_t column = 0;
};
/// The table that a member that is no tile belongs to by its name: seeds/ROW/COLUMN.seed, textures/ROW/COLUMN/SIZE.EXT,
/// residual/NNNNNNNN; nullopt where it is loose.
[[nodiscard]] std::optional<TablePlace> table_place(std::string_view name);
/// The name of a table's member.
[[nodiscard]] std::string member_name(const std::string& table, std::int64_t row, std::int64_t column);

}  // namespace isohf
