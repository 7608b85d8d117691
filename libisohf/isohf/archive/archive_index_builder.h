#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <unordered_set>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/container/table_writer.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/journal.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/memory/spill_buffer.h"
#include "isohf/base/output_file.h"

namespace isohf {

/// What an archive that is being written holds so far, and what follows from it: index, directory, content hash.
/// Memory: some 60 bytes for every 512 tiles and 8 for a row of them; records and directory lie in scratch files beside the archive.
class ArchiveIndexBuilder {
 public:
  /// folder  where the scratch files are made
  ArchiveIndexBuilder(const TileGrid& grid, const PlaneInfo& planes, const std::string& folder);

  /// Takes a step of writing: the tile with flat index next_tile(), or a member that stands before it.
  void add(const JournalRecord& record);
  /// A tile of a plane, or another member at its place in a table, all but its CRC: add_data_crc32() follows, in file order.
  void add_copy(PlaneTile tile, const ZipMember& member, const TableRecord& record, const Digest& digest);
  void add_copy(const TablePlace& place, const ZipMember& member);
  void add_data_crc32(std::uint32_t crc) { data_crc32_ = crc32_of_crc32(crc, data_crc32_); }
  /// Takes tiles from next_tile() on that are not there.
  void skip(std::int64_t tiles) { next_ += tiles; }

  [[nodiscard]] std::int64_t next_tile() const { return next_; }
  [[nodiscard]] std::int64_t tiles_stored() const { return tables_[0].members().stored; }
  [[nodiscard]] std::uint64_t tile_bytes() const { return tables_[0].members().compressed_bytes; }
  [[nodiscard]] TileStatistics statistics() const;
  /// Sums of the elevations by row of tiles, as far as there are such; statistics() adds these up in order.
  [[nodiscard]] const std::vector<double>& row_sums() const { return row_sums_; }
  [[nodiscard]] bool has_member(const std::string& name) const;
  /// Whether a coarse plane's tile may be added: there is such a one, behind all of its plane that were added.
  [[nodiscard]] bool takes(TileIndex tile, int plane) const;
  [[nodiscard]] MemberTotals members_in(const std::string& folder) const;
  /// What is known of a tile that was added.
  [[nodiscard]] TileEntry tile_entry(TileIndex tile, int plane) const;

  /// CRC-32 over the CRC-32s of all members' data as they stand in the file, in file order.
  [[nodiscard]] std::uint32_t data_crc32() const { return data_crc32_; }
  /// The content hash as text; call once.
  [[nodiscard]] std::string finish_hash(const Metadata& metadata) { return content_.finish(metadata); }
  /// Appends the member index.bin. When all is added; may be called again.
  [[nodiscard]] ZipMember append_index(OutputFile& part);
  /// Appends the directory, whose last entries are these two, and the end records.
  void append_directory(const ZipMember& index, const ZipMember& metadata, OutputFile& part) const;

 private:
  void add_up(const TileStatistics& tile);
  void add_entry(const ZipMember& member);
  void add_member(const std::optional<TablePlace>& place, const ZipMember& member);

  TileGrid grid_;
  TablesWriter tables_;
  std::vector<ZipMember> loose_;  ///< members in no table
  std::unordered_set<std::string> loose_names_;
  SpillBuffer directory_;
  std::uint64_t entries_ = 0;  ///< in it
  std::vector<std::byte> entry_;
  ContentHash content_;
  TileStatistics statistics_;  ///< but for the sum
  std::vector<double> row_sums_;
  std::int64_t next_ = 0;
  std::uint32_t data_crc32_ = 0;
};

}  // namespace isohf
