#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive/container/member_tables.h"
#include "isohf/base/memory/spill_buffer.h"
#include "isohf/base/zip.h"

namespace isohf {

/// A table of index.bin while its members are written, by ascending place. Memory: 56 bytes a page that holds anything,
/// and one page.
class TableWriter {
 public:
  /// rows  0 where they are not known before the last; page_records  0 for what suits the table's size
  TableWriter(std::string name, std::int64_t columns, std::int64_t rows, bool has_digests, const ScratchFolder& folder);

  [[nodiscard]] const MemberTable& members() const { return table_.members; }
  /// False where the place is not behind the one before, or outside the table.
  [[nodiscard]] bool takes(std::int64_t row, std::int64_t column) const;
  void add(std::int64_t row, std::int64_t column, const TableRecord& record, const Digest& digest);
  /// What was added there; nullopt where nothing was.
  [[nodiscard]] std::optional<TableRecord> find(std::int64_t row, std::int64_t column) const;

  /// The table is done: no add() follows. May be called again.
  void finish() { close_page(); }
  /// Places the parts in index.bin and gives the root; then description() holds.
  [[nodiscard]] std::vector<std::byte> place(std::uint64_t digests_at, std::uint64_t pages_at, std::uint64_t root_at);
  [[nodiscard]] const TableDescription& description() const { return table_; }
  [[nodiscard]] const SpillBuffer& digests() const { return digests_; }
  [[nodiscard]] const SpillBuffer& pages() const { return pages_; }

 private:
  [[nodiscard]] std::uint64_t flat(std::int64_t row, std::int64_t column) const {
    return static_cast<std::uint64_t>(row) * static_cast<std::uint64_t>(table_.members.columns) +
           static_cast<std::uint64_t>(column);
  }

  void close_page();

  TableDescription table_;
  bool grows_;
  std::uint64_t next_ = 0;  ///< the first place that may be added
  std::uint64_t page_ = 0;  ///< the page that is filled
  RootEntry entry_;         ///< of it
  std::vector<std::byte> bits_;
  std::vector<std::byte> records_;
  std::vector<std::byte> page_digests_;
  std::vector<std::pair<std::uint64_t, RootEntry>> closed_;  ///< by page; offsets in pages_ and digests_
  SpillBuffer pages_;
  SpillBuffer digests_;
};

/// A member's record, without a range.
[[nodiscard]] TableRecord record_of(const ZipMember& member, std::uint64_t data_offset);

/// The tables of an archive while they are written: the tiles, the coarse planes, and those of other members in the
/// order in which they are made.
class TablesWriter {
 public:
  /// grids  by plane; has_digests  of tiles; folder  for scratch files
  TablesWriter(const std::vector<TileGrid>& grids, bool has_digests, ScratchFolder folder);

  [[nodiscard]] TableWriter& operator[](std::size_t table) { return tables_[table]; }
  [[nodiscard]] const TableWriter& operator[](std::size_t table) const { return tables_[table]; }
  [[nodiscard]] const std::vector<TableWriter>& all() const { return tables_; }
  /// Whether there is such a coarse plane.
  [[nodiscard]] bool has_plane(int plane) const { return plane >= 1 && static_cast<std::size_t>(plane) < planes_; }
  /// The table that takes another member now; nullopt when none does, and it is loose.
  [[nodiscard]] std::optional<std::size_t> find_or_make(const TablePlace& place, const ZipMember& member);

  /// Ends all tables, and places them in index.bin. The footer lacks what only the file knows.
  [[nodiscard]] TablesFooter place();
  /// Hands over index.bin in pieces.
  void put(const TablesFooter& footer, const std::function<void(std::span<const std::byte>)>& take) const;

 private:
  /// As they come in index.bin: the coarse planes last.
  [[nodiscard]] std::vector<std::size_t> order() const;

  ScratchFolder folder_;
  std::vector<TableWriter> tables_;
  std::size_t planes_;
  std::int64_t columns_;  ///< of plane 0
  std::int64_t rows_;
  std::vector<std::byte> tail_;  ///< roots and descriptions
};

}  // namespace isohf
