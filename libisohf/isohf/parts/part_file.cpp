#include "isohf/parts/part_file.h"

#include <fmt/format.h>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {

const ArchiveReader& PartFile::archive() {
  if (!open_) open_ = std::make_unique<const ArchiveReader>(source().bytes, path_, ArchiveReader::Shards::kRead);
  return *open_;
}

const CopySource& PartFile::source() {
  if (!source_.bytes) source_ = {open_file_source(path_), path_};
  return source_;
}

const PagedIndex& PartFile::index() {
  if (!index_) {
    const ByteSource& file = *source().bytes;
    const OwnEntries own = find_own_entries(file, find_archive_end(file));
    if (own.index) index_ = PagedIndex::open(file, *own.index);
    if (!index_) throw Error(ErrorCode::kCorrupt, "has no index as it was written");
  }
  return *index_;
}

const std::vector<std::string>& PartFile::tile_tables() {
  if (knows_tables_) return tables_;
  for (const TableDescription& table : index().tables()) {
    const std::string& name = table.members.name;
    const bool is_by_tile = name.find("{column}") != std::string::npos;
    if (is_by_tile && !name.starts_with("seeds/") && !is_in_tile_folder(name)) tables_.push_back(name);
  }
  knows_tables_ = true;
  return tables_;
}

std::vector<PartFile::Stored> PartFile::stored(const std::string& table, std::int64_t row,
                                               std::pair<std::int64_t, std::int64_t> columns) try {
  std::vector<Stored> all;
  const auto at = index().find_table(table);
  if (!at) return all;
  if (const MemberTable& members = index().tables()[*at].members;
      row >= members.rows || columns.second > members.columns) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("its index has {}x{} of \"{}\"", members.columns, members.rows, table));
  }
  all.reserve(static_cast<std::size_t>(columns.second - columns.first));
  index().for_row(*at, row, columns.first, columns.second,
                  [&](std::int64_t column, const TableRecord& record, const Digest* digest) {
                    all.push_back({column, record, digest == nullptr ? Digest{} : *digest});
                  });
  return all;
} catch (const Error& error) {
  throw error.within(source_.name);
}

TileCodes PartFile::decode(const TileShape& shape, CodeType type, const Stored& tile) const {
  const TileEntry& entry = tile.record.entry;
  try {
    if (entry.payload_bytes > max_payload_bytes(shape, type))
      throw Error(ErrorCode::kCorrupt, fmt::format("states a payload of {} bytes", entry.payload_bytes));
    std::vector<std::byte> payload(entry.payload_bytes);
    inflate_exactly(SourceBytes(*source_.bytes, entry.offset_bytes, entry.compressed_bytes).bytes(), payload);
    if (crc32(payload) != entry.payload_crc32) throw Error(ErrorCode::kCorrupt, "has another CRC-32 than is stated");
    return decode_tile(shape, type, payload);
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: tile at byte {}", source_.name, entry.offset_bytes));
  }
}

}  // namespace isohf
