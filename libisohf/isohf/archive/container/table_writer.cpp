#include "isohf/archive/container/table_writer.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr std::uint32_t kGrowingPageRecords = 4096;
constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20U;
constexpr std::uint64_t kMostInRecord = 0xffffffffU;
/// Tables of other members: each costs a root, whatever it has.
constexpr std::size_t kMostOtherTables = 64;

/// Hands over what was spilled, in pieces.
void copy(const SpillBuffer& from, const std::function<void(std::span<const std::byte>)>& take) {
  std::vector<std::byte> piece;
  for (std::uint64_t at = 0; at < from.size_bytes(); at += piece.size()) {
    piece.resize(std::min(kPieceBytes, from.size_bytes() - at));
    from.read(at, piece);
    take(piece);
  }
}

}  // namespace

TableWriter::TableWriter(std::string name, std::int64_t columns, std::int64_t rows, bool has_digests,
                         const ScratchFolder& folder)
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

TableRecord record_of(const ZipMember& member, std::uint64_t data_offset) {
  TableRecord record;
  TileEntry& entry = record.entry;
  entry.stored = true;
  entry.offset_bytes = data_offset;
  entry.compressed_bytes = static_cast<std::uint32_t>(member.compressed_bytes);
  entry.payload_bytes = static_cast<std::uint32_t>(member.bytes);
  entry.payload_crc32 = member.crc32;
  record.deflated = member.method == ZipMethod::kDeflated;
  return record;
}

TablesWriter::TablesWriter(const std::vector<TileGrid>& grids, bool has_digests, ScratchFolder folder)
    : folder_(std::move(folder)),
      planes_(grids.size()),
      columns_(grids.front().tile_columns()),
      rows_(grids.front().tile_rows()) {
  for (const TileGrid& grid : grids) {
    tables_.emplace_back(tile_table_name(static_cast<int>(tables_.size())), grid.tile_columns(), grid.tile_rows(),
                         has_digests, folder_);
  }
}

std::optional<std::size_t> TablesWriter::find_or_make(const TablePlace& place, const ZipMember& member) {
  if (member.bytes > kMostInRecord || member.compressed_bytes > kMostInRecord) return std::nullopt;
  const auto found = std::ranges::find(
      tables_, place.table, [](const TableWriter& known) -> const std::string& { return known.members().name; });
  const auto table = static_cast<std::size_t>(found - tables_.begin());
  if (found == tables_.end()) {
    const bool by_tile = place.table.find("{column}") != std::string::npos;
    TableWriter made(place.table, by_tile ? columns_ : 1, by_tile ? rows_ : 0, false, folder_);
    if (!made.takes(place.row, place.column) || tables_.size() - planes_ == kMostOtherTables) return std::nullopt;
    tables_.push_back(std::move(made));
  }
  return tables_[table].takes(place.row, place.column) ? std::optional(table) : std::nullopt;
}

std::vector<std::size_t> TablesWriter::order() const {
  std::vector<std::size_t> order(tables_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::rotate(order.begin() + 1, order.begin() + static_cast<std::ptrdiff_t>(planes_), order.end());
  return order;
}

/// Digests first, then pages, roots and descriptions, the coarse planes' last: what is read first is near the end.
TablesFooter TablesWriter::place() {
  const std::vector<std::size_t> in_order = order();
  std::uint64_t digests_at = 0;
  std::uint64_t pages_at = 0;
  std::uint64_t roots_at = 0;
  for (TableWriter& table : tables_) {
    table.finish();
    pages_at += table.digests().size_bytes();
    roots_at += table.pages().size_bytes();
  }
  roots_at += pages_at;
  TablesFooter footer;
  std::vector<std::byte> descriptions;
  tail_.clear();
  for (const std::size_t at : in_order) {
    TableWriter& table = tables_[at];
    const std::vector<std::byte> root = table.place(digests_at, pages_at, roots_at + tail_.size());
    digests_at += table.digests().size_bytes();
    pages_at += table.pages().size_bytes();
    tail_.insert(tail_.end(), root.begin(), root.end());
    append_description(table.description(), descriptions);
    footer.in_tables += static_cast<std::uint64_t>(table.members().stored);
  }
  tail_.insert(tail_.end(), descriptions.begin(), descriptions.end());
  footer.tables = static_cast<std::uint32_t>(tables_.size());
  footer.index_bytes = roots_at + tail_.size() + kTablesFooterBytes;
  footer.descriptions_bytes = static_cast<std::uint32_t>(descriptions.size());
  footer.descriptions_crc32 = crc32(descriptions);
  return footer;
}

void TablesWriter::put(const TablesFooter& footer, const std::function<void(std::span<const std::byte>)>& take) const {
  for (const std::size_t table : order()) copy(tables_[table].digests(), take);
  for (const std::size_t table : order()) copy(tables_[table].pages(), take);
  take(tail_);
  std::vector<std::byte> end;
  append_tables_footer(footer, end);
  take(end);
}

}  // namespace isohf
