#include "isohf/archive/container/paged_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::uint64_t kMostCachedBytes = std::uint64_t{4} << 20U;

Digest digest_at(std::span<const std::byte> digests, std::size_t rank) {
  Digest digest{};
  std::ranges::copy(digests.subspan(rank * digest.size(), digest.size()), digest.begin());
  return digest;
}

}  // namespace

std::unique_ptr<PagedIndex> PagedIndex::open(const ByteSource& file, const ZipEntry& member) {
  if (member.method != ZipMethod::kStored || member.bytes != member.compressed_bytes) return nullptr;
  return open(file, member.header_offset + local_header_bytes(member), member.bytes, false);
}

std::unique_ptr<PagedIndex> PagedIndex::open_moved(const ByteSource& bytes) {
  return open(bytes, 0, bytes.size_bytes(), true);
}

std::unique_ptr<PagedIndex> PagedIndex::open(const ByteSource& file, std::uint64_t offset, std::uint64_t size,
                                             bool may_have_moved) {
  if (size < kTablesFooterBytes || offset > file.size_bytes() || size > file.size_bytes() - offset) return nullptr;
  const std::uint64_t footer_at = size - kTablesFooterBytes;
  const auto footer = parse_tables_footer(SourceBytes(file, offset + footer_at, kTablesFooterBytes).bytes());
  if (!footer || footer->index_bytes != size || (footer->data_offset != offset && !may_have_moved) ||
      footer->descriptions_bytes > footer_at) {
    return nullptr;
  }
  const SourceBytes descriptions(file, offset + footer_at - footer->descriptions_bytes, footer->descriptions_bytes);
  if (crc32(descriptions.bytes()) != footer->descriptions_crc32) return nullptr;
  auto tables = parse_descriptions(descriptions.bytes(), footer->tables);
  if (!tables) return nullptr;
  for (const TableDescription& table : *tables) {
    const std::uint64_t root_bytes = table.pages() * kRootEntryBytes;
    if (table.root_offset > size || root_bytes > size - table.root_offset) return nullptr;
  }
  return std::unique_ptr<PagedIndex>(new PagedIndex(file, offset, *footer, *std::move(tables)));
}

std::optional<std::size_t> PagedIndex::find_table(const std::string& name) const {
  for (std::size_t i = 0; i < tables_.size(); ++i) {
    if (tables_[i].members.name == name) return i;
  }
  return std::nullopt;
}

void PagedIndex::refuse(std::uint64_t offset_bytes, const TableDescription& table, const std::string& why) const {
  throw Error(ErrorCode::kCorrupt, fmt::format("member \"{}\" at byte {}: of \"{}\" {}", kIndexName,
                                               offset_ + offset_bytes, table.members.name, why));
}

PagedIndex::Bytes PagedIndex::range(std::uint64_t offset_bytes, std::uint64_t size_bytes, std::uint32_t crc,
                                    const TableDescription& table) const {
  if (offset_bytes > footer_.index_bytes || size_bytes > footer_.index_bytes - offset_bytes)
    refuse(offset_bytes, table, fmt::format("{} bytes reach past the index", size_bytes));
  auto bytes =
      std::make_shared<const std::vector<std::byte>>(SourceBytes(file_, offset_ + offset_bytes, size_bytes).take());
  if (const std::uint32_t found = crc32(*bytes); found != crc)
    refuse(offset_bytes, table,
           fmt::format("{} bytes have the CRC-32 {:08x}, {:08x} is stated", size_bytes, found, crc));
  return bytes;
}

PagedIndex::Bytes PagedIndex::cached(std::uint64_t offset_bytes, std::uint64_t size_bytes, std::uint32_t crc,
                                     const TableDescription& table) const {
  {
    const std::lock_guard lock(mutex_);
    if (const auto found = places_.find(offset_bytes); found != places_.end()) {
      recent_.splice(recent_.begin(), recent_, found->second);
      const Recent& known = recent_.front();
      if (known.bytes->size() == size_bytes && known.crc == crc) return known.bytes;
    }
  }
  Bytes bytes = range(offset_bytes, size_bytes, crc, table);
  const std::lock_guard lock(mutex_);
  if (places_.count(offset_bytes) != 0) return bytes;
  recent_.push_front({offset_bytes, crc, bytes});
  places_[offset_bytes] = recent_.begin();
  recent_bytes_ += size_bytes;
  while (recent_bytes_ > kMostCachedBytes && recent_.size() > 1) {
    recent_bytes_ -= recent_.back().bytes->size();
    places_.erase(recent_.back().offset);
    recent_.pop_back();
  }
  return bytes;
}

RootEntry PagedIndex::root_entry(std::size_t table, std::uint64_t page) const {
  const TableDescription& of = tables_[table];
  Bytes root;
  {
    const std::lock_guard lock(mutex_);
    root = roots_[table];
  }
  if (!root) {
    root = range(of.root_offset, of.pages() * kRootEntryBytes, of.root_crc32, of);
    const std::lock_guard lock(mutex_);
    roots_[table] = root;
  }
  const auto entry = parse_root_entry(std::span(*root).subspan(page * kRootEntryBytes, kRootEntryBytes));
  if (!entry || entry->stored > of.records_of(page))
    refuse(of.root_offset + page * kRootEntryBytes, of, fmt::format("the root's entry of page {} breaks a rule", page));
  return *entry;
}

PagedIndex::Bytes PagedIndex::page(std::size_t table, std::uint64_t page, const RootEntry& entry) const {
  const TableDescription& of = tables_[table];
  return cached(entry.page_offset, page_bytes(of.records_of(page), entry.stored), entry.page_crc32, of);
}

std::optional<PagedIndex::Place> PagedIndex::find(std::size_t table, std::int64_t row, std::int64_t column) const {
  const TableDescription& of = tables_[table];
  const auto slot = static_cast<std::uint64_t>(row * of.members.columns + column);
  const std::uint64_t number = slot / of.page_records;
  const RootEntry entry = root_entry(table, number);
  if (entry.stored == 0) return std::nullopt;
  const Bytes bytes = page(table, number, entry);
  const std::size_t bits = (of.records_of(number) + 7) / 8;
  const auto rank = rank_in_page(std::span(*bytes).first(bits), slot % of.page_records);
  if (!rank) return std::nullopt;
  return Place{entry, bytes, bits + *rank * kRecordBytes, *rank};
}

std::optional<TableRecord> PagedIndex::record(std::size_t table, std::int64_t row, std::int64_t column) const {
  const auto place = find(table, row, column);
  if (!place) return std::nullopt;
  return record_at(tables_[table], place->entry, *place->page, place->record_at, row, column);
}

TableRecord PagedIndex::record_at(const TableDescription& of, const RootEntry& entry, std::span<const std::byte> page,
                                  std::size_t at, std::int64_t row, std::int64_t column) const {
  const auto found = at + kRecordBytes <= page.size() ? parse_record(page.subspan(at, kRecordBytes)) : std::nullopt;
  if (!found) refuse(entry.page_offset + at, of, fmt::format("the record of ({},{}) breaks a rule", column, row));
  return *found;
}

std::optional<Digest> PagedIndex::digest(std::size_t table, std::int64_t row, std::int64_t column) const {
  if (!tables_[table].has_digests) return std::nullopt;
  const auto place = find(table, row, column);
  if (!place || place->rank >= place->entry.stored) return std::nullopt;
  return digest_at(*digests_of(tables_[table], place->entry), place->rank);
}

PagedIndex::Bytes PagedIndex::digests_of(const TableDescription& of, const RootEntry& entry) const {
  return cached(entry.digests_offset, sizeof(Digest) * std::uint64_t{entry.stored}, entry.digests_crc32, of);
}

void PagedIndex::for_row(std::size_t table, std::int64_t row, std::int64_t first, std::int64_t end,
                         const Found& found) const {
  const TableDescription& of = tables_[table];
  const auto start = static_cast<std::uint64_t>(row * of.members.columns);
  const std::uint64_t behind = start + static_cast<std::uint64_t>(end);
  for (std::uint64_t flat = start + static_cast<std::uint64_t>(first); flat < behind;) {
    const std::uint64_t number = flat / of.page_records;
    const std::uint64_t page_at = number * of.page_records;
    const std::uint64_t page_end = std::min(behind, page_at + of.records_of(number));
    const RootEntry entry = root_entry(table, number);
    const std::size_t bits = (of.records_of(number) + 7) / 8;
    Bytes bytes;
    Bytes digests;
    if (entry.stored > 0) {
      bytes = page(table, number, entry);
      if (of.has_digests) digests = digests_of(of, entry);
    }
    std::optional<std::size_t> next;  // its place among those that are stored
    for (; flat < page_end && bytes; ++flat) {
      const std::uint64_t bit = flat - page_at;
      if ((std::to_integer<unsigned>((*bytes)[bit / 8]) >> (bit % 8) & 1U) == 0) continue;
      const std::size_t rank = next ? *next : *rank_in_page(std::span(*bytes).first(bits), bit);
      next = rank + 1;
      const auto column = static_cast<std::int64_t>(flat - start);
      const TableRecord record = record_at(of, entry, *bytes, bits + rank * kRecordBytes, row, column);
      const Digest digest = digests ? digest_at(*digests, rank) : Digest{};
      found(column, record, digests ? &digest : nullptr);
    }
    flat = page_end;
  }
}

void PagedIndex::for_each(std::size_t table, const std::function<void(std::uint64_t, const TableRecord&)>& at,
                          const std::function<void(const std::string&)>& complain) const {
  const TableDescription& of = tables_[table];
  MemberTable all;
  for (std::uint64_t number = 0; number < of.pages(); ++number) {
    const RootEntry entry = root_entry(table, number);
    if (entry.stored == 0) continue;
    const std::uint64_t records = of.records_of(number);
    const Bytes bytes = page(table, number, entry);
    const std::size_t bits = (records + 7) / 8;
    RootEntry sum;
    for (std::uint64_t i = 0; i < 8 * bits; ++i) {
      if ((std::to_integer<unsigned>((*bytes)[i / 8]) >> (i % 8) & 1U) == 0) continue;
      const std::size_t place = bits + sum.stored * kRecordBytes;
      const auto record = i < records && sum.stored < entry.stored
                              ? parse_record(std::span(*bytes).subspan(place, kRecordBytes))
                              : std::nullopt;
      if (!record) refuse(entry.page_offset + place, of, fmt::format("the record of place {} breaks a rule", i));
      widen(record->entry, sum.stored == 0, sum.code_min, sum.code_max);
      widen(record->entry, all.stored == 0, all.code_min, all.code_max);
      sum.has_voids |= record->entry.has_voids;
      all.has_voids |= record->entry.has_voids;
      sum.compressed_bytes += record->entry.compressed_bytes;
      all.compressed_bytes += record->entry.compressed_bytes;
      ++sum.stored;
      ++all.stored;
      at(number * of.page_records + i, *record);
    }
    const auto in_root = [](const RootEntry& e) {
      return std::tuple(e.stored, e.compressed_bytes, e.code_min, e.code_max, e.has_voids);
    };
    if (in_root(sum) != in_root(entry))
      complain(fmt::format("member \"{}\": of \"{}\" the root does not say what page {} holds", kIndexName,
                           of.members.name, number));
  }
  const auto in_description = [](const MemberTable& t) {
    return std::tuple(t.stored, t.compressed_bytes, t.code_min, t.code_max, t.has_voids);
  };
  if (in_description(all) != in_description(of.members))
    complain(fmt::format("member \"{}\": \"{}\" counts {} members of {} bytes, its pages {} of {}", kIndexName,
                         of.members.name, of.members.stored, of.members.compressed_bytes, all.stored,
                         all.compressed_bytes));
}

}  // namespace isohf
