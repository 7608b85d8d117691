#pragma once

#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/container/paged_index.h"
#include "isohf/archive/writer.h"

namespace isohf {

/// An archive that members are copied from. One thread; what archive() gives is good until close().
class PartFile {
 public:
  explicit PartFile(std::shared_ptr<const ArchiveReader> open)
      : open_(std::move(open)), source_{{open_, &open_->source()}, open_->path()} {}
  /// Opened when it is asked for, and again after close(): of a thousand shards no more are open than are read.
  explicit PartFile(std::string path) : path_(std::move(path)) {}

  /// Rows are copied without it: a thousand shards say the same in their metadata.
  [[nodiscard]] const ArchiveReader& archive() {
    if (!open_) open_ = std::make_shared<const ArchiveReader>(source().bytes, path_);
    return *open_;
  }
  void close() {
    if (path_.empty()) return;
    index_.reset();
    open_.reset();
    source_ = {};
  }

  /// What its index says of members of a row, in `columns` from the first to before the second, by ascending column. The
  /// file is one that require_copyable() lets through.
  struct Stored {
    std::int64_t column;
    TableRecord record;
    Digest digest;  ///< of tiles
  };
  [[nodiscard]] std::vector<Stored> stored(const std::string& table, std::int64_t row,
                                           std::pair<std::int64_t, std::int64_t> columns);
  [[nodiscard]] const CopySource& source();
  /// Decodes tiles that stored() told of. Any thread.
  [[nodiscard]] std::vector<TileCodes> decode(const TileShape& shape, CodeType type,
                                              std::span<const Stored> tiles) const;

  /// Names of the tables of members that come with a tile, but for seeds.
  [[nodiscard]] const std::vector<std::string>& tile_tables();

  bool has_loose_members = true;  ///< may have, beside its own ones

 private:
  [[nodiscard]] const PagedIndex& index();

  std::string path_;
  std::shared_ptr<const ArchiveReader> open_;
  CopySource source_;
  std::unique_ptr<PagedIndex> index_;
  std::vector<std::string> tables_;
  bool knows_tables_ = false;
};

/// A reader that outlives it.
[[nodiscard]] inline std::shared_ptr<PartFile> part_file(const ArchiveReader& archive) {
  return std::make_shared<PartFile>(std::shared_ptr<const ArchiveReader>(std::shared_ptr<void>(), &archive));
}

/// Whether a member is one that every archive has.
[[nodiscard]] bool is_own_member(const std::string& name);

}  // namespace isohf
