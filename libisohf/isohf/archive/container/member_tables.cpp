#include "isohf/archive/container/member_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/bytes.h"

namespace isohf {
namespace {

constexpr std::uint64_t kMagic = 0x58444946484f5349;  // "ISOHFIDX"
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kStored = 1;
constexpr std::uint32_t kHasVoids = 2;
constexpr std::uint32_t kNotDeflated = 4;
constexpr std::uint32_t kHasDigests = 1;
constexpr std::uint32_t kLeastPageRecords = 512;
constexpr std::uint64_t kMostPages = std::uint64_t{1} << 16U;
constexpr std::size_t kDescriptionBytes = 80;  // and the name
constexpr std::uint32_t kMostTables = 4096;
constexpr std::string_view kRow = "{row}";
constexpr std::string_view kColumn = "{column}";
constexpr std::string_view kRow8 = "{row:8}";

/// Reads digits without leading zeros; nullopt where there are none.
std::optional<std::int64_t> take_number(std::string_view& text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const auto digits = static_cast<std::size_t>(end - text.data());
  if (error != std::errc{} || value < 0 || value >= kMaxTilesPerAxis || (text.front() == '0' && digits > 1) ||
      text.front() == '-') {
    return std::nullopt;
  }
  text.remove_prefix(digits);
  return value;
}

}  // namespace

std::uint64_t TableDescription::records_of(std::uint64_t page) const {
  return std::min<std::uint64_t>(page_records, records() - page * page_records);
}

std::uint32_t page_records_for(std::uint64_t records) {
  std::uint32_t page = kLeastPageRecords;
  while (records / page > kMostPages) page *= 2;
  return page;
}

std::uint64_t page_bytes(std::uint64_t records, std::uint32_t stored) {
  return (records + 7) / 8 + kRecordBytes * std::uint64_t{stored};
}

std::optional<std::size_t> rank_in_page(std::span<const std::byte> bits, std::uint64_t i) {
  const auto last = std::to_integer<unsigned>(bits[i / 8]);
  if ((last >> (i % 8) & 1U) == 0) return std::nullopt;
  const auto count = [](std::uint64_t word) { return static_cast<std::size_t>(std::popcount(word)); };
  std::size_t byte = 0;
  std::size_t rank = 0;
  for (; byte + 8 <= i / 8; byte += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bits.data() + byte, sizeof word);
    rank += count(word);
  }
  for (; byte < i / 8; ++byte) rank += count(std::to_integer<unsigned>(bits[byte]));
  return rank + count(last & ((1U << (i % 8)) - 1));
}

void append_record(const TableRecord& record, std::vector<std::byte>& out) {
  const TileEntry& entry = record.entry;
  ByteWriter writer(out);
  writer.write(entry.offset_bytes);
  writer.write(entry.compressed_bytes);
  writer.write(entry.payload_bytes);
  writer.write(entry.payload_crc32);
  writer.write(entry.code_min);
  writer.write(entry.code_max);
  writer.write(kStored | (entry.has_voids ? kHasVoids : 0) | (record.deflated ? 0 : kNotDeflated));
}

std::optional<TableRecord> parse_record(std::span<const std::byte> bytes) {
  TableRecord record;
  TileEntry& entry = record.entry;
  ByteReader reader(bytes);
  entry.offset_bytes = reader.read<std::uint64_t>();
  entry.compressed_bytes = reader.read<std::uint32_t>();
  entry.payload_bytes = reader.read<std::uint32_t>();
  entry.payload_crc32 = reader.read<std::uint32_t>();
  entry.code_min = reader.read<std::uint32_t>();
  entry.code_max = reader.read<std::uint32_t>();
  const auto flags = reader.read<std::uint32_t>();
  entry.stored = true;
  entry.has_voids = (flags & kHasVoids) != 0;
  record.deflated = (flags & kNotDeflated) == 0;
  if ((flags & kStored) == 0 || (flags & ~(kStored | kHasVoids | kNotDeflated)) != 0) return std::nullopt;
  return record;
}

void append_root_entry(const RootEntry& entry, std::vector<std::byte>& out) {
  if (entry.stored == 0) {
    out.resize(out.size() + kRootEntryBytes);
    return;
  }
  ByteWriter writer(out);
  writer.write(entry.page_offset);
  writer.write(entry.digests_offset);
  writer.write(entry.compressed_bytes);
  writer.write(entry.stored);
  writer.write(entry.page_crc32);
  writer.write(entry.digests_crc32);
  writer.write(entry.code_min);
  writer.write(entry.code_max);
  writer.write(entry.has_voids ? kHasVoids : 0U);
}

std::optional<RootEntry> parse_root_entry(std::span<const std::byte> bytes) {
  ByteReader reader(bytes);
  RootEntry entry;
  entry.page_offset = reader.read<std::uint64_t>();
  entry.digests_offset = reader.read<std::uint64_t>();
  entry.compressed_bytes = reader.read<std::uint64_t>();
  entry.stored = reader.read<std::uint32_t>();
  entry.page_crc32 = reader.read<std::uint32_t>();
  entry.digests_crc32 = reader.read<std::uint32_t>();
  entry.code_min = reader.read<std::uint32_t>();
  entry.code_max = reader.read<std::uint32_t>();
  const auto flags = reader.read<std::uint32_t>();
  entry.has_voids = flags != 0;
  if ((flags & ~kHasVoids) != 0) return std::nullopt;
  const bool is_zero = std::all_of(bytes.begin(), bytes.end(), [](std::byte byte) { return byte == std::byte{0}; });
  if (entry.stored == 0 && !is_zero) return std::nullopt;
  return entry;
}

void append_description(const TableDescription& table, std::vector<std::byte>& out) {
  const MemberTable& members = table.members;
  ByteWriter writer(out);
  writer.write(static_cast<std::uint32_t>(kDescriptionBytes + members.name.size()));
  writer.write(table.has_digests ? kHasDigests : 0U);
  writer.write(members.columns);
  writer.write(members.rows);
  writer.write(members.stored);
  writer.write(members.compressed_bytes);
  writer.write(table.root_offset);
  writer.write(table.root_crc32);
  writer.write(table.page_records);
  writer.write(members.code_min);
  writer.write(members.code_max);
  writer.write(members.has_voids ? kHasVoids : 0U);
  writer.write(static_cast<std::uint32_t>(members.name.size()));
  writer.write(std::uint64_t{0});
  writer.write_bytes(std::as_bytes(std::span<const char>(members.name)));
}

std::optional<std::vector<TableDescription>> parse_descriptions(std::span<const std::byte> bytes,
                                                                std::uint32_t tables) {
  std::vector<TableDescription> all;
  for (; tables > 0; --tables) {
    if (bytes.size() < kDescriptionBytes) return std::nullopt;
    ByteReader reader(bytes);
    const auto size = reader.read<std::uint32_t>();
    TableDescription table;
    MemberTable& members = table.members;
    const auto kind = reader.read<std::uint32_t>();
    table.has_digests = kind == kHasDigests;
    members.columns = reader.read<std::int64_t>();
    members.rows = reader.read<std::int64_t>();
    members.stored = reader.read<std::int64_t>();
    members.compressed_bytes = reader.read<std::uint64_t>();
    table.root_offset = reader.read<std::uint64_t>();
    table.root_crc32 = reader.read<std::uint32_t>();
    table.page_records = reader.read<std::uint32_t>();
    members.code_min = reader.read<std::uint32_t>();
    members.code_max = reader.read<std::uint32_t>();
    const auto flags = reader.read<std::uint32_t>();
    members.has_voids = flags != 0;
    const auto name_bytes = reader.read<std::uint32_t>();
    const auto reserved = reader.read<std::uint64_t>();
    const bool fits = reserved == 0 && (kind & ~kHasDigests) == 0 && (flags & ~kHasVoids) == 0 &&
                      members.columns >= 1 && members.rows >= 1 && members.columns <= kMaxTilesPerAxis &&
                      members.rows <= kMaxTilesPerAxis && members.columns * members.rows <= kMaxTiles &&
                      members.stored >= 0 && members.stored <= members.columns * members.rows &&
                      table.page_records >= kLeastPageRecords && table.page_records <= kMaxTiles / kMostPages &&
                      size <= bytes.size() && size >= kDescriptionBytes && name_bytes <= size - kDescriptionBytes;
    if (!fits) return std::nullopt;
    const auto name = reader.read_bytes(name_bytes);
    members.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
    all.push_back(std::move(table));
    bytes = bytes.subspan(size);
  }
  if (!bytes.empty()) return std::nullopt;
  return all;
}

void append_tables_footer(const TablesFooter& footer, std::vector<std::byte>& out) {
  const std::size_t start = out.size();
  ByteWriter writer(out);
  writer.write(kMagic);
  writer.write(kVersion);
  writer.write(footer.tables);
  writer.write(footer.index_bytes);
  writer.write(footer.data_offset);
  writer.write(footer.members);
  writer.write(footer.in_tables);
  writer.write(footer.descriptions_bytes);
  writer.write(footer.descriptions_crc32);
  writer.write(std::uint32_t{0});
  writer.write(crc32(std::span<const std::byte>(out).subspan(start)));
}

std::optional<TablesFooter> parse_tables_footer(std::span<const std::byte> bytes) {
  if (bytes.size() != kTablesFooterBytes) return std::nullopt;
  ByteReader reader(bytes);
  if (reader.read<std::uint64_t>() != kMagic || reader.read<std::uint32_t>() != kVersion) return std::nullopt;
  TablesFooter footer;
  footer.tables = reader.read<std::uint32_t>();
  footer.index_bytes = reader.read<std::uint64_t>();
  footer.data_offset = reader.read<std::uint64_t>();
  footer.members = reader.read<std::uint64_t>();
  footer.in_tables = reader.read<std::uint64_t>();
  footer.descriptions_bytes = reader.read<std::uint32_t>();
  footer.descriptions_crc32 = reader.read<std::uint32_t>();
  const auto reserved = reader.read<std::uint32_t>();
  if (reserved != 0 || footer.tables < 1 || footer.tables > kMostTables ||
      reader.read<std::uint32_t>() != crc32(bytes.first(kTablesFooterBytes - 4))) {
    return std::nullopt;
  }
  return footer;
}

bool code_less(std::uint32_t a, std::uint32_t b) {
  // Positive floats come in the order of their bits, as codes do; negative ones in the opposite order before them.
  const auto key = [](std::uint32_t bits) { return (bits >> 31U) != 0 ? ~bits : bits | 0x80000000U; };
  return key(a) < key(b);
}

void widen(const TileEntry& tile, bool is_first, std::uint32_t& min, std::uint32_t& max) {
  if (is_first || code_less(tile.code_min, min)) min = tile.code_min;
  if (is_first || code_less(max, tile.code_max)) max = tile.code_max;
}

std::string tile_table_name(int plane) {
  return plane == 0 ? fmt::format("tiles/{}/{}.tile", kRow, kColumn)
                    : fmt::format("planes/{}/{}/{}.tile", plane, kRow, kColumn);
}

std::optional<TablePlace> table_place(std::string_view name) {
  for (const std::string_view folder : {std::string_view("seeds/"), std::string_view("textures/")}) {
    if (!name.starts_with(folder)) continue;
    std::string_view rest = name.substr(folder.size());
    const auto row = take_number(rest);
    if (!row || !rest.starts_with('/')) return std::nullopt;
    rest.remove_prefix(1);
    const auto column = rest.empty() ? std::nullopt : take_number(rest);
    if (!column || rest.find_first_of("{}") != std::string_view::npos) return std::nullopt;
    return TablePlace{fmt::format("{}{}/{}{}", folder, kRow, kColumn, rest), *row, *column};
  }
  constexpr std::string_view kResiduals = "residual/";
  if (!name.starts_with(kResiduals) || name.size() != kResiduals.size() + 8) return std::nullopt;
  std::string_view digits = name.substr(kResiduals.size());
  std::int64_t row = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), row);
  if (error != std::errc{} || end != digits.data() + digits.size() || digits.front() == '-' || row >= kMaxTilesPerAxis)
    return std::nullopt;
  return TablePlace{fmt::format("{}{}", kResiduals, kRow8), row, 0};
}

std::string member_name(const std::string& table, std::int64_t row, std::int64_t column) {
  std::string name = table;
  const auto put = [&](std::string_view key, const std::string& text) {
    if (const std::size_t at = name.find(key); at != std::string::npos) name.replace(at, key.size(), text);
  };
  put(kRow8, fmt::format("{:08}", row));
  put(kRow, fmt::format("{}", row));
  put(kColumn, fmt::format("{}", column));
  return name;
}

}  // namespace isohf
