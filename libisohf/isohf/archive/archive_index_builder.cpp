#include "isohf/archive/archive_index_builder.h"

#include <algorithm>

#include "isohf/archive/codec/tile_codes.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile_index.h"
#include "isohf/base/assert.h"

namespace isohf {

void ArchiveIndexBuilder::add(const JournalRecord& record) {
  if (record.kind != JournalRecord::Kind::kEmptyTile) data_crc32_ = crc32_of_crc32(record.data_crc32, data_crc32_);
  if (record.kind == JournalRecord::Kind::kMember) {
    members_.push_back({next_, record.member});
    names_.insert(record.member.name);
    return;
  }
  TileEntry entry;
  entry.stored = record.kind == JournalRecord::Kind::kTile;
  if (entry.stored) {
    entry.offset_bytes = record.member.header_offset + local_header_bytes(record.member);
    entry.compressed_bytes = static_cast<std::uint32_t>(record.member.compressed_bytes);
    entry.payload_bytes = static_cast<std::uint32_t>(record.member.bytes);
    entry.payload_crc32 = record.member.crc32;
    entry.code_min = record.code_min;
    entry.code_max = record.code_max;
    entry.has_voids = record.has_voids;
    ++stored_;
  }
  tile_bytes_ += entry.compressed_bytes;
  append_index_record(entry, index_);
  content_.add_tile(record.digest);
  add_up(record.statistics);
  ++next_;
}

void ArchiveIndexBuilder::add_up(const TileStatistics& tile) {
  statistics_.vertices += tile.vertices;
  statistics_.voids += tile.voids;
  statistics_.clamped += tile.clamped;
  statistics_.sum += tile.sum;
  statistics_.min = std::min(statistics_.min, tile.min);
  statistics_.max = std::max(statistics_.max, tile.max);
  statistics_.worst_rounding = std::max(statistics_.worst_rounding, tile.worst_rounding);
}

MemberTotals ArchiveIndexBuilder::members_in(const std::string& folder) const {
  MemberTotals totals;
  for (const Placed& placed : members_) {
    if (!placed.member.name.starts_with(folder)) continue;
    ++totals.members;
    totals.bytes += placed.member.compressed_bytes;
  }
  return totals;
}

TileEntry ArchiveIndexBuilder::tile_entry(std::int64_t flat) const {
  const auto at = static_cast<std::size_t>(flat) * kIndexRecordBytes;
  const auto entry = parse_index_record(std::span(index_).subspan(at, kIndexRecordBytes));
  ISOHF_ASSERT(entry.has_value());
  return *entry;
}

ZipMember ArchiveIndexBuilder::tile_member(std::int64_t flat) const {
  const TileEntry entry = tile_entry(flat);
  ZipMember member{tile_name(grid_.tile_at(flat)), ZipMethod::kDeflated, entry.payload_crc32,
                   entry.compressed_bytes,         entry.payload_bytes,  entry.offset_bytes};
  if (entry.stored) member.header_offset -= local_header_bytes(member);
  return member;
}

/// Hands the directory's entries over in file order, a few at a time, with their number; index.bin's is not among them.
void ArchiveIndexBuilder::for_each_directory_chunk(
    const ZipMember& metadata, const std::function<void(std::span<const std::byte>, std::uint64_t)>& at) const {
  constexpr std::size_t kChunkBytes = std::size_t{1} << 16U;
  std::vector<std::byte> chunk;
  std::uint64_t entries = 0;
  const auto add = [&](const ZipMember& member) {
    append_directory_entry(member, chunk);
    ++entries;
    if (chunk.size() < kChunkBytes) return;
    at(chunk, entries);
    chunk.clear();
    entries = 0;
  };
  add(metadata);
  std::size_t placed = 0;
  for (std::int64_t flat = 0; flat <= grid_.tile_count(); ++flat) {
    for (; placed < members_.size() && members_[placed].before_tile == flat; ++placed) add(members_[placed].member);
    if (flat == grid_.tile_count()) break;
    const ZipMember member = tile_member(flat);
    if (member.bytes != 0) add(member);
  }
  at(chunk, entries);
}

std::span<const std::byte> ArchiveIndexBuilder::finish_index(const ZipMember& metadata) {
  index_.resize(static_cast<std::size_t>(next_) * kIndexRecordBytes);  // without the footer of a call before
  IndexFooter footer;
  footer.record_count = static_cast<std::uint64_t>(grid_.tile_count());
  footer.stored_count = static_cast<std::uint64_t>(stored_);
  footer.records_crc32 = crc32(index_);
  for_each_directory_chunk(metadata, [&](std::span<const std::byte> chunk, std::uint64_t entries) {
    footer.directory_entries += entries;
    footer.directory_bytes += chunk.size();
    footer.directory_crc32 = crc32(chunk, footer.directory_crc32);
  });
  append_index_footer(footer, index_);
  return index_;
}

void ArchiveIndexBuilder::append_directory(const ZipMember& metadata, const ZipMember& index, OutputFile& part) const {
  const std::uint64_t offset = part.position();
  std::uint64_t entries = 1;
  for_each_directory_chunk(metadata, [&](std::span<const std::byte> chunk, std::uint64_t in_chunk) {
    part.append(chunk);
    entries += in_chunk;
  });
  std::vector<std::byte> tail;
  append_directory_entry(index, tail);
  append_end_records(entries, offset, part.position() + tail.size() - offset, tail);
  part.append(tail);
}

}  // namespace isohf
