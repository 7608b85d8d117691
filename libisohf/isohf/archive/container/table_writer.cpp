#include "isohf/archive/container/table_writer.h"

#include <algorithm>
#include <array>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr std::uint32_t kGrowingPageRecords = 4096;

}  // namespace

TableWriter::TableWriter(std::string name, std::int64_t columns, std::int64_t rows, bool has_digests,
                         const std::string& folder)
    : grows_(rows == 0), pages_(folder), digests_(folder) {
  table_.members.name = std::move(name);
  table_.members.columns = columns;
  table_.members.rows = rows;
  table_.has_digests = has_digests;
  table_.page_records = grows_ ? kGrowingPageRecords : page_records_for(table_.records());
  bits_.resize(table_.page_records / 8);
}

bool TableWriter::takes(std::int64_t row, std::int64_t column) const {
  return column < table_.members.columns && (grows_ || row < table_.members.rows) && flat(row, column) >= next_;
}

void TableWriter::add(std::int64_t row, std::int64_t column, const TableRecord& record, const Digest& digest) {
  ISOHF_ASSERT(takes(row, column));
  const std::uint64_t at = flat(row, column);
  next_ = at + 1;
  if (grows_) table_.members.rows = row + 1;
  if (at / table_.page_records != page_) close_page();
  page_ = at / table_.page_records;
  const std::uint64_t bit = at % table_.page_records;
  bits_[bit / 8] |= static_cast<std::byte>(1U << (bit % 8));
  append_record(record, records_);
  if (table_.has_digests) page_digests_.insert(page_digests_.end(), digest.begin(), digest.end());
  const TileEntry& tile = record.entry;
  MemberTable& all = table_.members;
  widen(tile, entry_.stored == 0, entry_.code_min, entry_.code_max);
  widen(tile, all.stored == 0, all.code_min, all.code_max);
  entry_.has_voids |= tile.has_voids;
  entry_.compressed_bytes += tile.compressed_bytes;
  ++entry_.stored;
  all.has_voids |= tile.has_voids;
  all.compressed_bytes += tile.compressed_bytes;
  ++all.stored;
}

void TableWriter::close_page() {
  if (entry_.stored == 0) return;
  const auto bits = std::span(bits_).first((table_.records_of(page_) + 7) / 8);
  entry_.page_offset = pages_.size_bytes();
  entry_.digests_offset = digests_.size_bytes();
  entry_.page_crc32 = crc32(records_, crc32(bits));
  entry_.digests_crc32 = crc32(page_digests_);
  pages_.append(bits);
  pages_.append(records_);
  digests_.append(page_digests_);
  closed_.emplace_back(page_, entry_);
  entry_ = {};
  records_.clear();
  page_digests_.clear();
  std::fill(bits_.begin(), bits_.end(), std::byte{0});
}

std::optional<TableRecord> TableWriter::find(std::int64_t row, std::int64_t column) const {
  const std::uint64_t at = flat(row, column);
  const std::uint64_t page = at / table_.page_records;
  const std::uint64_t bit = at % table_.page_records;
  if (page == page_ && entry_.stored > 0) {
    const auto rank = rank_in_page(bits_, bit);
    if (!rank) return std::nullopt;
    return parse_record(std::span(records_).subspan(*rank * kRecordBytes, kRecordBytes));
  }
  const auto found = std::lower_bound(closed_.begin(), closed_.end(), page,
                                      [](const auto& closed, std::uint64_t wanted) { return closed.first < wanted; });
  if (found == closed_.end() || found->first != page) return std::nullopt;
  std::vector<std::byte> bits((table_.records_of(page) + 7) / 8);
  pages_.read(found->second.page_offset, bits);
  const auto rank = rank_in_page(bits, bit);
  if (!rank) return std::nullopt;
  std::array<std::byte, kRecordBytes> record{};
  pages_.read(found->second.page_offset + bits.size() + *rank * kRecordBytes, record);
  return parse_record(record);
}

std::vector<std::byte> TableWriter::place(std::uint64_t digests_at, std::uint64_t pages_at, std::uint64_t root_at) {
  std::vector<std::byte> root;
  root.reserve(table_.pages() * kRootEntryBytes);
  for (auto [page, entry] : closed_) {
    root.resize(page * kRootEntryBytes);
    entry.page_offset += pages_at;
    entry.digests_offset = table_.has_digests ? entry.digests_offset + digests_at : 0;
    append_root_entry(entry, root);
  }
  root.resize(table_.pages() * kRootEntryBytes);
  table_.root_offset = root_at;
  table_.root_crc32 = crc32(root);
  return root;
}

}  // namespace isohf
