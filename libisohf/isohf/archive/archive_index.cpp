#include "isohf/archive/archive_index.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "isohf/archive/container/table_writer.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Without an index, a grid of so many vertices may be stated, and of so many tiles for each stored one.
constexpr std::uint64_t kMostVerticesOnTrust = std::uint64_t{1} << 22U;
constexpr std::uint64_t kMostTilesOnTrust = 64;
/// A tile takes this many bytes of the file at least: local header, name, data.
constexpr std::uint64_t kLeastTileBytes = 45;

/// The index that a repacked archive still has as a member, to be read wherever it is; nullptr when it has none.
struct OldIndex {
  std::shared_ptr<const ByteSource> bytes;
  std::unique_ptr<PagedIndex> index;

  OldIndex(const ByteSource& file, const std::optional<ZipEntry>& member) {
    try {
      if (!member) return;
      bytes = memory_source(member_from(file, *member, checked_data_offset(file, *member)));
      index = PagedIndex::open_moved(*bytes);
    } catch (const Error&) {
      // Tiles are read without it.
    }
  }

  /// Gives a tile the range that the old index states, if that is of the same tile.
  void take_range(std::size_t table, TileIndex place, TileEntry& tile) const {
    try {
      const auto found = index->record(table, place.row, place.column);
      if (!found || found->entry.payload_crc32 != tile.payload_crc32 ||
          found->entry.payload_bytes != tile.payload_bytes) {
        return;
      }
      tile.code_min = found->entry.code_min;
      tile.code_max = found->entry.code_max;
      tile.has_voids = found->entry.has_voids;
    } catch (const Error&) {
      // Its page is damaged.
    }
  }
};

}  // namespace

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

ArchiveIndex::ArchiveIndex(const ByteSource& file, const ZipEnd& end, const OwnEntries& own, const Metadata& metadata)
    : file_(file), metadata_(metadata), grids_(plane_grids(metadata)) {
  if (!use_index(own)) use_directory(end);
}

/// The tables of the planes' tiles; empty when one is missing or of another grid.
std::vector<std::size_t> ArchiveIndex::plane_tables(const PagedIndex& index) const {
  std::vector<std::size_t> tables;
  for (std::size_t plane = 0; plane < grids_.size(); ++plane) {
    const auto table = index.find_table(tile_table_name(static_cast<int>(plane)));
    if (!table) return {};
    const MemberTable& members = index.tables()[*table].members;
    if (members.columns != grids_[plane].tile_columns() || members.rows != grids_[plane].tile_rows()) return {};
    tables.push_back(*table);
  }
  return tables;
}

/// Takes the index if it stands as it was written.
bool ArchiveIndex::use_index(const OwnEntries& own) {
  if (!own.index) return false;
  auto index = PagedIndex::open(file_, *own.index);
  if (!index) return false;
  plane_tables_ = plane_tables(*index);
  if (plane_tables_.empty()) return false;
  data_end_ = own.index->header_offset;
  index_ = std::move(index);
  const auto stated = static_cast<std::uint64_t>(index_->tables()[plane_tables_.front()].members.stored);
  const std::uint64_t stored = std::min(stated, data_end_ / kLeastTileBytes);
  check_grid(most_tiles(stored), stored);
  return true;
}

void ArchiveIndex::use_directory(const ZipEnd& end) {
  data_end_ = end.directory_offset;
  TablesWriter tables(grids_, false, std::nullopt);
  struct Listed {
    std::size_t table;
    std::int64_t row;
    std::int64_t column;
    TableRecord record;
  };
  std::vector<Listed> listed;
  std::optional<ZipEntry> index;
  std::uint64_t stored = 0;
  for_each_member(file_, end, Tiles::kVisited, [&](const ZipEntry& member, std::uint64_t data_offset) {
    if (member.name == kIndexName) index = member;
    TableRecord record = record_of(member, data_offset);
    if (!is_in_tile_folder(member.name)) {
      const auto place = table_place(member.name);
      const auto table = place ? tables.find_or_make(*place, member) : std::nullopt;
      if (table) listed.push_back({*table, place->row, place->column, record});
      return;
    }
    if (const std::string why = why_bad_tile(member, grids_); !why.empty())
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}", describe(member), why));
    if (member.method != ZipMethod::kStored && member.method != ZipMethod::kDeflated) {
      throw Error(ErrorCode::kUnsupported, fmt::format("{}: compression method {}, only 0 and 8 are read",
                                                       describe(member), static_cast<int>(member.method)));
    }
    const auto [plane, tile] = *tile_from_name(member.name);
    set_unknown_range(metadata_.quantisation, record.entry);
    listed.push_back({static_cast<std::size_t>(plane), tile.row, tile.column, record});
    ++stored;
  });
  const OldIndex old(file_, index);
  const std::vector<std::size_t> old_tables = old.index ? plane_tables(*old.index) : std::vector<std::size_t>();
  const auto vertices = static_cast<std::uint64_t>(metadata_.grid.shape().stored_vertex_count());
  check_grid(old_tables.empty() ? kMostVerticesOnTrust / vertices + kMostTilesOnTrust * stored : most_tiles(stored),
             stored);
  std::ranges::sort(listed, {}, [](const Listed& one) { return std::tuple(one.table, one.row, one.column); });
  for (Listed& one : listed) {
    if (one.table < old_tables.size()) old.take_range(old_tables[one.table], {one.column, one.row}, one.record.entry);
    tables[one.table].add(one.row, one.column, one.record, {});
  }
  std::vector<std::byte> bytes;
  TablesFooter footer = tables.place();
  tables.put(footer, [&](std::span<const std::byte> piece) { bytes.insert(bytes.end(), piece.begin(), piece.end()); });
  made_ = memory_source(std::move(bytes));
  index_ = PagedIndex::open_moved(*made_);
  plane_tables_ = plane_tables(*index_);
}

void ArchiveIndex::check_grid(std::uint64_t most, std::uint64_t stored) const {
  if (static_cast<std::uint64_t>(metadata_.grid.tile_count()) <= most || shard_record(metadata_)) return;
  throw Error(ErrorCode::kCorrupt, fmt::format("metadata: tiles: {}x{} are stated, too many for the {} that are stored",
                                               metadata_.grid.tile_columns(), metadata_.grid.tile_rows(), stored));
}

TableRecord ArchiveIndex::checked_record(TileIndex tile, int plane) const {
  const auto found = index_->record(plane_tables_[static_cast<std::size_t>(plane)], tile.row, tile.column);
  if (!found) return {};
  const TileEntry& entry = found->entry;
  const auto refuse = [&](const std::string& why) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("{}tile ({},{}) at byte {}: {}", plane == 0 ? "" : fmt::format("plane {}: ", plane),
                            tile.column, tile.row, entry.offset_bytes, why));
  };
  if (entry.offset_bytes > data_end_ || entry.compressed_bytes > data_end_ - entry.offset_bytes) {
    refuse(fmt::format("its {} bytes reach past byte {}", entry.compressed_bytes, data_end_));
  }
  const std::uint64_t most = max_payload_bytes(metadata_.grid.shape(), metadata_.quantisation.type);
  if (entry.payload_bytes > most) {
    refuse(fmt::format("states a payload of {} bytes, a tile of this shape has at most {}", entry.payload_bytes, most));
  }
  return *found;
}

std::optional<Digest> ArchiveIndex::digest(TileIndex tile, int plane) const {
  return index_->digest(plane_tables_[static_cast<std::size_t>(plane)], tile.row, tile.column);
}

}  // namespace isohf
