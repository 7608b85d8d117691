#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/paged_index.h"
#include "isohf/base/source_bytes.h"
#include "isohf/metadata.h"

namespace isohf {

/// A range that no index states and nobody knows without decoding, as of repacked archives: voids, and the widest range.
void set_unknown_range(const Quantisation& quantisation, TileEntry& entry);
[[nodiscard]] bool has_unknown_range(const Quantisation& quantisation, const TileEntry& entry);

/// Where the members of an archive stand: as its index says, or the ZIP directory where the two do not agree.
class TileLocator {
 public:
  /// file, metadata  must outlive it. Throws Error{kCorrupt, kUnsupported} where neither can be used.
  TileLocator(const ByteSource& file, const ZipEnd& end, const OwnEntries& own, const Metadata& metadata);

  [[nodiscard]] bool by_directory() const { return paged_ == nullptr; }
  /// The index, where it is used.
  [[nodiscard]] const PagedIndex* paged() const { return paged_.get(); }
  [[nodiscard]] std::span<const TileGrid> grids() const { return grids_; }  ///< by plane

  /// A tile's record, held against the file and what a tile may take. Throws Error{kCorrupt, kIo}.
  [[nodiscard]] TileEntry checked_record(TileIndex tile, int plane) const;
  /// Whether a stored tile is deflated, as all are that an index tells of.
  [[nodiscard]] bool is_deflated(TileIndex tile, int plane) const;
  [[nodiscard]] std::optional<Digest> digest(TileIndex tile, int plane) const;
  /// The tables of the tiles, counted one by one where paged() does not know them.
  [[nodiscard]] std::vector<MemberTable> tile_tables() const;

  /// Compares the index with a directory: one line for each member that they do not agree on. Not with by_directory().
  void check_against(const ArchiveDirectory& directory, const Complain& complain) const;

 private:
  /// A tile as the directory has it.
  struct Listed {
    int plane;
    std::int64_t flat;
    TileEntry entry;
    bool deflated;
  };

  [[nodiscard]] bool use_pages(const OwnEntries& own);
  void use_directory();
  void take_ranges_from_index(const ArchiveDirectory& directory);
  [[nodiscard]] bool take_ranges_from_pages(std::vector<std::byte> old);
  [[nodiscard]] std::vector<std::size_t> plane_tables(const PagedIndex& index) const;
  [[nodiscard]] const Listed* find_listed(std::int64_t flat, int plane) const;
  [[nodiscard]] TileEntry record(TileIndex tile, int plane) const;

  const ByteSource& file_;
  ZipEnd end_;
  const Metadata& metadata_;
  std::vector<TileGrid> grids_;
  std::unique_ptr<PagedIndex> paged_;
  std::vector<std::size_t> plane_tables_;  ///< with `paged_`: the table of each plane
  std::vector<Listed> listed_;             ///< with by_directory(): its tiles, by plane and flat index
  std::uint64_t data_end_ = 0;             ///< tiles lie before it; without by_directory() the index begins there
};

}  // namespace isohf
