#pragma once

#include <cstdint>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/base/source_bytes.h"
#include "isohf/metadata.h"

namespace isohf {

/// Where the tiles of an archive stand: as its index says, or the ZIP directory where the two do not agree.
class TileLocator {
 public:
  /// file, metadata  must outlive it    keeps_index  whether the index stays in memory, 32 bytes a tile; else each tile's
  /// record is read when it is asked for. Throws Error{kCorrupt, kUnsupported} where neither can be used.
  TileLocator(const ByteSource& file, const ZipEnd& end, const Metadata& metadata, bool keeps_index);

  [[nodiscard]] bool by_directory() const { return by_directory_; }

  /// A tile's record, held against the file and what a tile may take. Throws Error{kCorrupt, kIo}.
  [[nodiscard]] TileEntry checked_record(TileIndex tile) const;
  /// Whether a stored tile is deflated, as all are that an index tells of.
  [[nodiscard]] bool is_deflated(TileIndex tile) const;

  /// Holds the index against a directory: one line for each tile that they do not agree on.
  void check_against(const ArchiveDirectory& directory, const Complain& complain) const;

 private:
  /// A tile as the directory has it.
  struct Listed {
    std::int64_t flat;
    TileEntry entry;
    bool deflated;
  };

  [[nodiscard]] bool use_index(bool keeps_index);
  void use_directory();
  void take_ranges_from_index(const ArchiveDirectory& directory);
  [[nodiscard]] const Listed* find_listed(std::int64_t flat) const;
  [[nodiscard]] TileEntry record(std::int64_t flat) const;

  const ByteSource& file_;
  ZipEnd end_;
  const Metadata& metadata_;
  bool by_directory_ = false;
  SourceBytes index_;               ///< its records, where they are kept
  std::vector<Listed> listed_;      ///< with `by_directory_`: its tiles, by flat index
  std::uint64_t stored_count_ = 0;  ///< without `by_directory_`: as the index's footer has it
  std::uint64_t data_end_ = 0;      ///< tiles lie before it; without `by_directory_` the index begins there
};

}  // namespace isohf
