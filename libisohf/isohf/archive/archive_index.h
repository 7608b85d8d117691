#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/paged_index.h"
#include "isohf/metadata.h"

namespace isohf {

/// A range that no index states and nobody knows without decoding, as of repacked archives: voids, and the widest range.
void set_unknown_range(const Quantisation& quantisation, TileEntry& entry);
[[nodiscard]] bool has_unknown_range(const Quantisation& quantisation, const TileEntry& entry);

/// Where the members of an archive are: index.bin as it was written, or one that is made from the ZIP directory when
/// that cannot be used. Made, it takes 33 bytes a member.
class ArchiveIndex {
 public:
  /// file, metadata  must outlive it. Throws Error{kCorrupt, kUnsupported} when neither can be used.
  ArchiveIndex(const ByteSource& file, const ZipEnd& end, const OwnEntries& own, const Metadata& metadata);

  /// Then offsets and sizes are those of the directory, and local headers have been compared with it.
  [[nodiscard]] bool by_directory() const { return made_ != nullptr; }
  [[nodiscard]] const PagedIndex& tables() const { return *index_; }
  [[nodiscard]] std::span<const TileGrid> grids() const { return grids_; }  ///< by plane

  /// A tile's record, compared with the file and with what a tile may take. Throws Error{kCorrupt, kIo}.
  [[nodiscard]] TableRecord checked_record(TileIndex tile, int plane) const;
  [[nodiscard]] std::optional<Digest> digest(TileIndex tile, int plane) const;

 private:
  [[nodiscard]] bool use_index(const OwnEntries& own);
  void use_directory(const ZipEnd& end);
  /// Refuses a grid of more tiles than the stored ones make likely: going through it must come to an end.
  void check_grid(std::uint64_t most, std::uint64_t stored) const;
  [[nodiscard]] std::vector<std::size_t> plane_tables(const PagedIndex& index) const;

  const ByteSource& file_;
  const Metadata& metadata_;
  std::vector<TileGrid> grids_;
  std::shared_ptr<const ByteSource> made_;  ///< index.bin as it is made from the directory
  std::unique_ptr<PagedIndex> index_;
  std::vector<std::size_t> plane_tables_;  ///< the table of each plane
  std::uint64_t data_end_ = 0;             ///< tiles lie before it
};

}  // namespace isohf
