#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/container/paged_index.h"
#include "isohf/archive/writer.h"

namespace isohf {

/// A shard that members are copied from. Opened on use, and again after close(): of a thousand shards no more are open
/// than are read. One thread; what archive() returns is valid until close().
class PartFile {
 public:
  explicit PartFile(std::string path) : path_(std::move(path)) {}

  /// Rows are copied without it: a thousand shards have the same metadata.
  [[nodiscard]] const ArchiveReader& archive();
  void close() {
    index_.reset();
    open_.reset();
    source_ = {};
  }

  /// The index's records of members of a row, in `columns` from the first to before the second, by ascending column. The
  /// file is one that passed require_copyable().
  struct Stored {
    std::int64_t column;
    TableRecord record;
    Digest digest;  ///< of tiles
  };
  [[nodiscard]] std::vector<Stored> stored(const std::string& table, std::int64_t row,
                                           std::pair<std::int64_t, std::int64_t> columns);
  [[nodiscard]] const CopySource& source();
  /// Decodes a tile that stored() returned. Any thread.
  [[nodiscard]] TileCodes decode(const TileShape& shape, CodeType type, const Stored& tile) const;

  /// Names of the tables of members that come with a tile, but for seeds.
  [[nodiscard]] const std::vector<std::string>& tile_tables();

 private:
  [[nodiscard]] const PagedIndex& index();

  std::string path_;
  std::unique_ptr<const ArchiveReader> open_;
  CopySource source_;
  std::unique_ptr<PagedIndex> index_;
  std::vector<std::string> tables_;
  bool knows_tables_ = false;
};

}  // namespace isohf
