#include "isohf/archive/tile_index.h"

#include "isohf/archive/deflate/deflate.h"
#include "isohf/base/bytes.h"

namespace isohf {
namespace {

constexpr std::uint64_t kIndexMagic = 0x58444946484f5349;  // "ISOHFIDX"
constexpr std::uint32_t kVersion = 1;
constexpr std::uint32_t kStored = 1;
constexpr std::uint32_t kHasVoids = 2;

}  // namespace

std::uint32_t read_record(std::span<const std::byte> record, TileEntry& entry) {
  ByteReader reader(record);
  entry.offset_bytes = reader.read<std::uint64_t>();
  entry.compressed_bytes = reader.read<std::uint32_t>();
  entry.payload_bytes = reader.read<std::uint32_t>();
  entry.payload_crc32 = reader.read<std::uint32_t>();
  entry.code_min = reader.read<std::uint32_t>();
  entry.code_max = reader.read<std::uint32_t>();
  return reader.read<std::uint32_t>();
}

std::optional<TileEntry> parse_index_record(std::span<const std::byte> record) {
  TileEntry entry;
  const std::uint32_t flags = read_record(record, entry);
  entry.stored = (flags & kStored) != 0;
  entry.has_voids = (flags & kHasVoids) != 0;
  if ((flags & ~(kStored | kHasVoids)) != 0) return std::nullopt;
  if (entry.stored) return entry;
  for (const std::byte byte : record) {
    if (byte != std::byte{0}) return std::nullopt;
  }
  return TileEntry{};
}

std::optional<IndexFooter> parse_index_footer(std::span<const std::byte> bytes) {
  if (bytes.size() != kIndexFooterBytes) return std::nullopt;
  ByteReader reader(bytes);
  if (reader.read<std::uint64_t>() != kIndexMagic || reader.read<std::uint32_t>() != kVersion ||
      reader.read<std::uint32_t>() != kIndexRecordBytes) {
    return std::nullopt;
  }
  IndexFooter footer;
  footer.record_count = reader.read<std::uint64_t>();
  footer.stored_count = reader.read<std::uint64_t>();
  footer.directory_entries = reader.read<std::uint64_t>();
  footer.directory_bytes = reader.read<std::uint64_t>();
  footer.directory_crc32 = reader.read<std::uint32_t>();
  footer.records_crc32 = reader.read<std::uint32_t>();
  const auto reserved = reader.read<std::uint32_t>();
  if (reserved != 0 || reader.read<std::uint32_t>() != crc32(bytes.first(kIndexFooterBytes - 4))) return std::nullopt;
  return footer;
}

void set_unknown_range(const Quantisation& quantisation, TileEntry& entry) {
  const bool is_float = quantisation.type == CodeType::kF32;
  entry.has_voids = true;
  entry.code_min = is_float ? 0xff800000U : 0U;
  entry.code_max = is_float ? 0x7f800000U : quantisation.max_code();
}

bool has_unknown_range(const Quantisation& quantisation, const TileEntry& entry) {
  TileEntry unknown = entry;
  set_unknown_range(quantisation, unknown);
  return entry.has_voids && entry.code_min == unknown.code_min && entry.code_max == unknown.code_max;
}

}  // namespace isohf
