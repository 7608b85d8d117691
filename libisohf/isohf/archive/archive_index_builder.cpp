#include "isohf/archive/archive_index_builder.h"

#include <algorithm>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/assert.h"

namespace isohf {
namespace {

constexpr std::uint64_t kPieceBytes = std::uint64_t{1} << 20U;

std::vector<TileGrid> grids_of(const TileGrid& grid, const PlaneInfo& planes) {
  Metadata metadata(grid);
  metadata.planes = planes;
  return plane_grids(metadata);
}

}  // namespace

ArchiveIndexBuilder::ArchiveIndexBuilder(const TileGrid& grid, const PlaneInfo& planes, const std::string& folder)
    : grid_(grid), tables_(grids_of(grid, planes), true, folder), directory_(folder) {}

void ArchiveIndexBuilder::add(const JournalRecord& record) {
  if (record.kind == JournalRecord::Kind::kEmptyTile) {
    add_up(record.statistics);
    ++next_;
    return;
  }
  add_data_crc32(record.data_crc32);
  if (record.kind == JournalRecord::Kind::kMember) {
    add_member(table_place(record.member.name), record.member);
    return;
  }
  TableRecord stored = record_of(record.member, record.member.header_offset + local_header_bytes(record.member));
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
  content_.add_tile(next_, digest);
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
  if (const auto table = place ? tables_.find_or_make(*place, member) : std::nullopt) {
    const std::uint64_t data_offset = member.header_offset + local_header_bytes(member);
    tables_[*table].add(place->row, place->column, record_of(member, data_offset), {});
    return;
  }
  loose_.push_back(member);
  loose_names_.insert(member.name);
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

bool ArchiveIndexBuilder::has_member(const std::string& name) const {
  if (loose_names_.count(name) != 0) return true;
  const auto place = table_place(name);
  return place && std::ranges::any_of(tables_.all(), [&](const TableWriter& table) {
           return table.members().name == place->table && place->column < table.members().columns &&
                  place->row < table.members().rows && table.find(place->row, place->column).has_value();
         });
}

bool ArchiveIndexBuilder::takes(TileIndex tile, int plane) const {
  return tables_.has_plane(plane) && tile.row >= 0 && tile.column >= 0 &&
         tables_[static_cast<std::size_t>(plane)].takes(tile.row, tile.column);
}

MemberTotals ArchiveIndexBuilder::members_in(const std::string& folder) const {
  MemberTotals totals;
  for (const TableWriter& table : tables_.all()) {
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
  TablesFooter footer = tables_.place();
  const std::uint64_t size = footer.index_bytes;
  ZipMember member{kIndexName, ZipMethod::kStored, 0, size, size, part.position()};
  footer.data_offset = member.header_offset + local_header_bytes(member);
  footer.members = entries_;
  std::vector<std::byte> header;
  append_local_header(member, header);
  part.append(header);
  tables_.put(footer, [&](std::span<const std::byte> bytes) {
    member.crc32 = crc32(bytes, member.crc32);
    part.append(bytes);
  });
  ISOHF_ASSERT(part.position() == footer.data_offset + size);
  header.clear();
  append_local_header(member, header);
  part.write_at(member.header_offset, header);
  return member;
}

void ArchiveIndexBuilder::append_directory(const ZipMember& index, const ZipMember& metadata, OutputFile& part) const {
  const std::uint64_t offset = part.position();
  std::vector<std::byte> piece;
  for (std::uint64_t at = 0; at < directory_.size_bytes(); at += piece.size()) {
    piece.resize(std::min(kPieceBytes, directory_.size_bytes() - at));
    directory_.read(at, piece);
    part.append(piece);
  }
  std::vector<std::byte> tail;
  append_directory_entry(index, tail);
  append_directory_entry(metadata, tail);
  append_end_records(entries_ + 2, offset, part.position() + tail.size() - offset, tail);
  part.append(tail);
}

}  // namespace isohf
