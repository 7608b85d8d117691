#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "isohf/archive/container/member_tables.h"
#include "isohf/base/zip.h"
#include "isohf/byte_source.h"

namespace isohf {

/// index.bin while it is read: roots and pages come from the file when they are asked for, and the last
/// few MiB of pages stay. Any number of threads at once. What is read throws Error{kCorrupt} where its CRC or a rule is
/// broken, and as the file does.
class PagedIndex {
 public:
  /// nullptr where the member is no such index, was moved or is damaged in its last part. `file` must outlive it.
  [[nodiscard]] static std::unique_ptr<PagedIndex> open(const ByteSource& file, const ZipEntry& member);
  /// The same of the member's bytes alone, wherever it stood.
  [[nodiscard]] static std::unique_ptr<PagedIndex> open_moved(const ByteSource& bytes);

  [[nodiscard]] const std::vector<TableDescription>& tables() const { return tables_; }
  [[nodiscard]] const TablesFooter& footer() const { return footer_; }
  [[nodiscard]] std::optional<std::size_t> find_table(const std::string& name) const;

  /// nullopt where the member is not there.
  [[nodiscard]] std::optional<TableRecord> record(std::size_t table, std::int64_t row, std::int64_t column) const;
  [[nodiscard]] std::optional<Digest> digest(std::size_t table, std::int64_t row, std::int64_t column) const;

  /// Goes through what is there of a row, from column `first` to before `end`; digest  nullptr where the table has none
  using Found = std::function<void(std::int64_t column, const TableRecord&, const Digest* digest)>;
  void for_row(std::size_t table, std::int64_t row, std::int64_t first, std::int64_t end, const Found& found) const;

  /// Goes through a table by ascending place, and holds root and description against the records on the way: what does
  /// not agree goes to `complain`.
  void for_each(std::size_t table, const std::function<void(std::uint64_t flat, const TableRecord&)>& at,
                const std::function<void(const std::string&)>& complain) const;

 private:
  using Bytes = std::shared_ptr<const std::vector<std::byte>>;
  [[nodiscard]] static std::unique_ptr<PagedIndex> open(const ByteSource& file, std::uint64_t offset_bytes,
                                                        std::uint64_t size_bytes, bool may_have_moved);
  PagedIndex(const ByteSource& file, std::uint64_t offset_bytes, const TablesFooter& footer,
             std::vector<TableDescription> tables)
      : file_(file), offset_(offset_bytes), footer_(footer), tables_(std::move(tables)), roots_(tables_.size()) {}

  [[nodiscard]] Bytes range(std::uint64_t offset_bytes, std::uint64_t size_bytes, std::uint32_t crc,
                            const TableDescription& table) const;
  [[nodiscard]] Bytes cached(std::uint64_t offset_bytes, std::uint64_t size_bytes, std::uint32_t crc,
                             const TableDescription& table) const;
  /// Where a member that is there stands in its page.
  struct Place {
    RootEntry entry;
    Bytes page;
    std::size_t record_at;  ///< byte of the page
    std::size_t rank;       ///< among those that are there
  };
  [[nodiscard]] std::optional<Place> find(std::size_t table, std::int64_t row, std::int64_t column) const;
  [[nodiscard]] RootEntry root_entry(std::size_t table, std::uint64_t page) const;
  /// A page's bits and records.
  [[nodiscard]] Bytes page(std::size_t table, std::uint64_t page, const RootEntry& entry) const;
  [[nodiscard]] Bytes digests_of(const TableDescription& of, const RootEntry& entry) const;
  /// The record that begins at a byte of a page: (column, row) of the table.
  [[nodiscard]] TableRecord record_at(const TableDescription& of, const RootEntry& entry,
                                      std::span<const std::byte> page, std::size_t at, std::int64_t row,
                                      std::int64_t column) const;
  [[noreturn]] void refuse(std::uint64_t offset_bytes, const TableDescription& table, const std::string& why) const;

  const ByteSource& file_;
  std::uint64_t offset_;
  TablesFooter footer_;
  std::vector<TableDescription> tables_;
  mutable std::mutex mutex_;
  mutable std::vector<Bytes> roots_;
  struct Recent {
    std::uint64_t offset;
    std::uint32_t crc;
    Bytes bytes;
  };
  mutable std::list<Recent> recent_;  ///< by last use, the latest first
  mutable std::unordered_map<std::uint64_t, std::list<Recent>::iterator> places_;
  mutable std::uint64_t recent_bytes_ = 0;
};

}  // namespace isohf
