#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <unordered_set>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/codec/tile_codes.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/journal.h"
#include "isohf/base/output_file.h"

namespace isohf {

/// What an archive that is being written holds so far, and what follows from it: index, directory, content hash.
/// Memory: 32 bytes a tile.
class ArchiveIndexBuilder {
 public:
  explicit ArchiveIndexBuilder(const TileGrid& grid) : grid_(grid) {}

  /// Takes a step of writing: the tile with flat index next_tile(), or a member that stands before it.
  void add(const JournalRecord& record);

  [[nodiscard]] std::int64_t next_tile() const { return next_; }
  [[nodiscard]] std::int64_t tiles_stored() const { return stored_; }
  [[nodiscard]] std::uint64_t tile_bytes() const { return tile_bytes_; }
  [[nodiscard]] const TileStatistics& statistics() const { return statistics_; }
  [[nodiscard]] bool has_member(const std::string& name) const { return names_.count(name) != 0; }
  [[nodiscard]] MemberTotals members_in(const std::string& folder) const;
  /// What is known of a tile that was added.
  [[nodiscard]] TileEntry tile_entry(std::int64_t flat) const;

  /// CRC-32 over the CRC-32s of all members' data as they stand in the file, in file order.
  [[nodiscard]] std::uint32_t data_crc32() const { return data_crc32_; }
  /// The content hash as text; call once.
  [[nodiscard]] std::string finish_hash(const Metadata& metadata) { return content_.finish(metadata); }
  /// The member index.bin; `metadata` is the entry that the directory begins with. When all is added.
  [[nodiscard]] std::span<const std::byte> finish_index(const ZipMember& metadata);
  /// Appends the directory, whose last entry is that of index.bin, and the end records.
  void append_directory(const ZipMember& metadata, const ZipMember& index, OutputFile& part) const;

 private:
  /// A member that is no tile, and the tile that it stands before.
  struct Placed {
    std::int64_t before_tile;
    ZipMember member;
  };

  void add_up(const TileStatistics& tile);
  [[nodiscard]] ZipMember tile_member(std::int64_t flat) const;
  void for_each_directory_chunk(const ZipMember& metadata,
                                const std::function<void(std::span<const std::byte>, std::uint64_t)>& at) const;

  TileGrid grid_;
  std::vector<std::byte> index_;  ///< records of the tiles added so far
  std::vector<Placed> members_;
  std::unordered_set<std::string> names_;
  ContentHash content_;
  TileStatistics statistics_;
  std::int64_t next_ = 0;
  std::int64_t stored_ = 0;
  std::uint64_t tile_bytes_ = 0;
  std::uint32_t data_crc32_ = 0;
};

}  // namespace isohf
