#include "isohf/archive/archive_index_builder.h"

#include <algorithm>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20U;
constexpr std::uint64_t kMostInRecord = 0xffffffffU;

/// Hands over what was spilled, in pieces.
template <typename To>
void copy(const SpillBuffer& from, const To& to) {
  std::vector<std::byte> piece;
  for (std::uint64_t at = 0; at < from.size_bytes(); at += piece.size()) {
    piece.resize(std::min(kPieceBytes, from.size_bytes() - at));
    from.read(at, piece);
    to(piece);
  }
}

TableRecord record_of(const ZipMember& member) {
  TableRecord record;
  TileEntry& entry = record.entry;
  entry.stored = true;
  entry.offset_bytes = member.header_offset + local_header_bytes(member);
  entry.compressed_bytes = static_cast<std::uint32_t>(member.compressed_bytes);
  entry.payload_bytes = static_cast<std::uint32_t>(member.bytes);
  entry.payload_crc32 = member.crc32;
  record.deflated = member.method == ZipMethod::kDeflated;
  return record;
}

}  // namespace

ArchiveIndexBuilder::ArchiveIndexBuilder(const TileGrid& grid, const PlaneInfo& planes, const std::string& folder)
    : grid_(grid), folder_(folder), directory_(folder) {
  Metadata metadata(grid);
  metadata.planes = planes;
  for (const TileGrid& plane : plane_grids(metadata)) {
    const int number = static_cast<int>(tables_.size());
    tables_.emplace_back(tile_table_name(number), plane.tile_columns(), plane.tile_rows(), true, folder);
  }
  tile_tables_ = tables_.size();
}

void ArchiveIndexBuilder::add(const JournalRecord& record) {
  if (record.kind == JournalRecord::Kind::kEmptyTile) {
    content_.add_tile(record.digest);
    add_up(record.statistics);
    ++next_;
    return;
  }
  add_data_crc32(record.data_crc32);
  if (record.kind == JournalRecord::Kind::kMember) {
    add_member(table_place(record.member.name), record.member);
    return;
  }
  TableRecord stored = record_of(record.member);
  stored.entry.code_min = record.code_min;
  stored.entry.code_max = record.code_max;
  stored.entry.has_voids = record.has_voids;
  if (record.kind == JournalRecord::Kind::kTile) add_up(record.statistics);
  add_copy(*tile_from_name(record.member.name), record.member, stored, record.digest);
}

void ArchiveIndexBuilder::add_copy(PlaneTile tile, const ZipMember& member, const TableRecord& record,
                                   const Digest& digest) {
  add_entry(member);
  tables_[static_cast<std::size_t>(tile.plane)].add(tile.tile.row, tile.tile.column, record, digest);
  if (tile.plane != 0) return;
  content_.add_tile(digest);
  ++next_;
}

void ArchiveIndexBuilder::add_copy(const TablePlace& place, const ZipMember& member) {
  add_member(place, member);
}

void ArchiveIndexBuilder::add_entry(const ZipMember& member) {
  entry_.clear();
  append_directory_entry(member, entry_);
  directory_.append(entry_);
  ++entries_;
}

void ArchiveIndexBuilder::add_member(const std::optional<TablePlace>& place, const ZipMember& member) {
  add_entry(member);
  if (place && put_in_table(*place, member)) return;
  loose_.push_back(member);
  loose_names_.insert(member.name);
}

/// False where the member does not fit into its kind's table.
bool ArchiveIndexBuilder::put_in_table(const TablePlace& place, const ZipMember& member) {
  if (member.bytes > kMostInRecord || member.compressed_bytes > kMostInRecord) return false;
  const auto is_it = [&](const TableWriter& known) { return known.members().name == place.table; };
  auto table = std::find_if(tables_.begin(), tables_.end(), is_it);
  if (table == tables_.end()) {
    const bool by_tile = place.table.find("{column}") != std::string::npos;
    TableWriter made(place.table, by_tile ? grid_.tile_columns() : 1, by_tile ? grid_.tile_rows() : 0, false, folder_);
    if (!made.takes(place.row, place.column)) return false;
    tables_.push_back(std::move(made));
    table = tables_.end() - 1;
  }
  if (!table->takes(place.row, place.column)) return false;
  table->add(place.row, place.column, record_of(member), {});
  return true;
}

void ArchiveIndexBuilder::add_up(const TileStatistics& tile) {
  statistics_.vertices += tile.vertices;
  statistics_.voids += tile.voids;
  statistics_.clamped += tile.clamped;
  row_sums_.resize(static_cast<std::size_t>(next_ / grid_.tile_columns()) + 1);
  row_sums_.back() += tile.sum;
  statistics_.min = std::min(statistics_.min, tile.min);
  statistics_.max = std::max(statistics_.max, tile.max);
  statistics_.worst_rounding = std::max(statistics_.worst_rounding, tile.worst_rounding);
}

TileStatistics ArchiveIndexBuilder::statistics() const {
  TileStatistics all = statistics_;
  for (const double sum : row_sums_) all.sum += sum;
  return all;
}

void ArchiveIndexBuilder::skip(std::int64_t tiles, std::span<const std::byte> void_digest) {
  for (std::int64_t i = 0; i < tiles; ++i) content_.add_tile(void_digest);
  next_ += tiles;
}

bool ArchiveIndexBuilder::has_member(const std::string& name) const {
  if (loose_names_.count(name) != 0) return true;
  const auto place = table_place(name);
  return place && std::any_of(tables_.begin(), tables_.end(), [&](const TableWriter& table) {
           return table.members().name == place->table && place->column < table.members().columns &&
                  place->row < table.members().rows && table.find(place->row, place->column).has_value();
         });
}

bool ArchiveIndexBuilder::takes(TileIndex tile, int plane) const {
  return plane >= 1 && static_cast<std::size_t>(plane) < tile_tables_ && tile.row >= 0 && tile.column >= 0 &&
         tables_[static_cast<std::size_t>(plane)].takes(tile.row, tile.column);
}

MemberTotals ArchiveIndexBuilder::members_in(const std::string& folder) const {
  MemberTotals totals;
  for (const TableWriter& table : tables_) {
    if (!table.members().name.starts_with(folder)) continue;
    totals.members += table.members().stored;
    totals.bytes += table.members().compressed_bytes;
  }
  for (const ZipMember& member : loose_) {
    if (!member.name.starts_with(folder)) continue;
    ++totals.members;
    totals.bytes += member.compressed_bytes;
  }
  return totals;
}

TileEntry ArchiveIndexBuilder::tile_entry(TileIndex tile, int plane) const {
  const auto record = tables_[static_cast<std::size_t>(plane)].find(tile.row, tile.column);
  return record ? record->entry : TileEntry{};
}

ZipMember ArchiveIndexBuilder::append_index(OutputFile& part) {
  // Digests first, then pages, roots and descriptions, the coarse planes' last: what is asked for first is near the end.
  std::vector<TableWriter*> order;
  for (TableWriter& table : tables_) order.push_back(&table);
  std::rotate(order.begin() + 1, order.begin() + static_cast<std::ptrdiff_t>(tile_tables_), order.end());
  std::uint64_t size = 0;
  std::vector<std::uint64_t> digests_at;
  std::vector<std::uint64_t> pages_at;
  for (TableWriter* const table : order) {
    table->finish();
    digests_at.push_back(size);
    size += table->digests().size_bytes();
  }
  for (TableWriter* const table : order) {
    pages_at.push_back(size);
    size += table->pages().size_bytes();
  }
  std::vector<std::byte> tail;
  std::vector<std::byte> descriptions;
  TablesFooter footer;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::vector<std::byte> root = order[i]->place(digests_at[i], pages_at[i], size + tail.size());
    tail.insert(tail.end(), root.begin(), root.end());
    append_description(order[i]->description(), descriptions);
    footer.in_tables += static_cast<std::uint64_t>(order[i]->members().stored);
  }
  size += tail.size() + descriptions.size() + kTablesFooterBytes;
  ZipMember member{kIndexName, ZipMethod::kStored, 0, size, size, part.position()};
  footer.tables = static_cast<std::uint32_t>(order.size());
  footer.index_bytes = size;
  footer.data_offset = member.header_offset + local_header_bytes(member);
  footer.members = entries_;
  footer.descriptions_bytes = static_cast<std::uint32_t>(descriptions.size());
  footer.descriptions_crc32 = crc32(descriptions);
  tail.insert(tail.end(), descriptions.begin(), descriptions.end());
  append_tables_footer(footer, tail);

  std::vector<std::byte> header;
  append_local_header(member, header);
  part.append(header);
  const auto put = [&](std::span<const std::byte> bytes) {
    member.crc32 = crc32(bytes, member.crc32);
    part.append(bytes);
  };
  for (const TableWriter* const table : order) copy(table->digests(), put);
  for (const TableWriter* const table : order) copy(table->pages(), put);
  put(tail);
  ISOHF_ASSERT(part.position() == footer.data_offset + size);
  header.clear();
  append_local_header(member, header);
  part.write_at(member.header_offset, header);
  return member;
}

void ArchiveIndexBuilder::append_directory(const ZipMember& index, const ZipMember& metadata, OutputFile& part) const {
  const std::uint64_t offset = part.position();
  copy(directory_, [&](std::span<const std::byte> piece) { part.append(piece); });
  std::vector<std::byte> tail;
  append_directory_entry(index, tail);
  append_directory_entry(metadata, tail);
  append_end_records(entries_ + 2, offset, part.position() + tail.size() - offset, tail);
  part.append(tail);
}

}  // namespace isohf
