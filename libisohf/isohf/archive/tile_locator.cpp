#include "isohf/archive/tile_locator.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// A grid of so many vertices may be stated where there is no index, and of so many tiles for each that is there.
constexpr std::uint64_t kMostVerticesOnTrust = std::uint64_t{1} << 22U;
constexpr std::uint64_t kMostTilesOnTrust = 64;

/// Gives a tile of a repacked archive the range that its old index states, where that is of the same tile.
void take_range(const std::optional<TileEntry>& found, TileEntry& tile) {
  if (!found || !found->stored || found->payload_crc32 != tile.payload_crc32 ||
      found->payload_bytes != tile.payload_bytes) {
    return;
  }
  tile.code_min = found->code_min;
  tile.code_max = found->code_max;
  tile.has_voids = found->has_voids;
}

std::string describe(TileIndex tile, int plane) {
  return fmt::format("{}tile ({},{})", plane == 0 ? "" : fmt::format("plane {}: ", plane), tile.column, tile.row);
}

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

TileLocator::TileLocator(const ByteSource& file, const ZipEnd& end, const OwnEntries& own, const Metadata& metadata)
    : file_(file), end_(end), metadata_(metadata), grids_(plane_grids(metadata)) {
  if (!use_pages(own)) use_directory();
}

/// The tables of the planes' tiles; empty where one is missing or of another grid.
std::vector<std::size_t> TileLocator::plane_tables(const PagedIndex& index) const {
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

/// Takes the index where it stands as it was written.
bool TileLocator::use_pages(const OwnEntries& own) {
  if (!own.index) return false;
  auto index = PagedIndex::open(file_, *own.index);
  if (!index) return false;
  plane_tables_ = plane_tables(*index);
  if (plane_tables_.empty()) return false;
  data_end_ = own.index->header_offset;
  paged_ = std::move(index);
  return true;
}

void TileLocator::use_directory() {
  data_end_ = end_.directory_offset;
  const ArchiveDirectory directory =
      read_directory(file_, end_, grids_, [](const std::string& what) { throw Error(ErrorCode::kCorrupt, what); });
  for (const ArchiveDirectory::Tile& tile : directory.tiles) {
    if (tile.entry.method != ZipMethod::kStored && tile.entry.method != ZipMethod::kDeflated) {
      throw Error(ErrorCode::kUnsupported, fmt::format("{}: compression method {}, only 0 and 8 are read",
                                                       describe(tile.entry), static_cast<int>(tile.entry.method)));
    }
    TileEntry entry;
    entry.stored = true;
    entry.offset_bytes = tile.data_offset;
    entry.compressed_bytes = static_cast<std::uint32_t>(tile.entry.compressed_bytes);
    entry.payload_bytes = static_cast<std::uint32_t>(tile.entry.bytes);
    entry.payload_crc32 = tile.entry.crc32;
    set_unknown_range(metadata_.quantisation, entry);
    listed_.push_back({tile.plane, tile.flat, entry, tile.entry.method == ZipMethod::kDeflated});
  }
  take_ranges_from_index(directory);
}

/// A repacked archive still has its old index as a member: what it says of tiles that are the same is true.
void TileLocator::take_ranges_from_index(const ArchiveDirectory& directory) {
  const auto member = std::find_if(directory.members.begin(), directory.members.end(),
                                   [](const ArchiveDirectory::Member& m) { return m.entry.name == kIndexName; });
  std::vector<std::byte> old;
  try {
    if (member != directory.members.end()) old = member_from(file_, member->entry, member->data_offset);
  } catch (const Error&) {
    // Tiles are read without it.
  }
  if (!old.empty() && take_ranges_from_pages(std::move(old))) return;
  // Without an index as large, the metadata's word alone stands for the grid: going through it must have an end.
  const auto tiles = static_cast<std::uint64_t>(metadata_.grid.tile_count());
  const auto vertices = static_cast<std::uint64_t>(metadata_.grid.shape().stored_vertex_count());
  if (tiles <= kMostVerticesOnTrust / vertices + kMostTilesOnTrust * listed_.size()) return;
  throw Error(ErrorCode::kCorrupt,
              fmt::format("metadata: tiles: {}x{} are stated, {} are there, and no index of as many",
                          metadata_.grid.tile_columns(), metadata_.grid.tile_rows(), listed_.size()));
}

/// False where those bytes are no index of this grid.
bool TileLocator::take_ranges_from_pages(std::vector<std::byte> old) {
  const auto bytes = memory_source(std::move(old));
  const auto index = PagedIndex::open_moved(*bytes);
  if (!index) return false;
  const std::vector<std::size_t> tables = plane_tables(*index);
  if (tables.empty()) return false;
  for (Listed& tile : listed_) {
    const TileIndex place = grids_[static_cast<std::size_t>(tile.plane)].tile_at(tile.flat);
    try {
      const auto found = index->record(tables[static_cast<std::size_t>(tile.plane)], place.row, place.column);
      take_range(found ? std::optional(found->entry) : std::nullopt, tile.entry);
    } catch (const Error&) {
      // Its page is damaged.
    }
  }
  return true;
}

const TileLocator::Listed* TileLocator::find_listed(std::int64_t flat, int plane) const {
  const auto found = std::lower_bound(
      listed_.begin(), listed_.end(), std::pair(plane, flat),
      [](const Listed& tile, const auto& wanted) { return std::pair(tile.plane, tile.flat) < wanted; });
  return found != listed_.end() && found->flat == flat && found->plane == plane ? &*found : nullptr;
}

TileEntry TileLocator::record(TileIndex tile, int plane) const {
  if (paged_) {
    const auto found = paged_->record(plane_tables_[static_cast<std::size_t>(plane)], tile.row, tile.column);
    return found ? found->entry : TileEntry{};
  }
  const Listed* const listed = find_listed(grids_[static_cast<std::size_t>(plane)].flat_index(tile), plane);
  return listed == nullptr ? TileEntry{} : listed->entry;
}

TileEntry TileLocator::checked_record(TileIndex tile, int plane) const {
  const TileEntry entry = record(tile, plane);
  if (!entry.stored) return entry;
  const auto refuse = [&](const std::string& why) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{} at byte {}: {}", describe(tile, plane), entry.offset_bytes, why));
  };
  if (entry.offset_bytes > data_end_ || entry.compressed_bytes > data_end_ - entry.offset_bytes) {
    refuse(fmt::format("its {} bytes reach past byte {}", entry.compressed_bytes, data_end_));
  }
  const std::uint64_t most = max_payload_bytes(metadata_.grid.shape(), metadata_.quantisation.type);
  if (entry.payload_bytes > most) {
    refuse(fmt::format("states a payload of {} bytes, a tile of this shape has at most {}", entry.payload_bytes, most));
  }
  return entry;
}

bool TileLocator::is_deflated(TileIndex tile, int plane) const {
  return paged_ || find_listed(grids_[static_cast<std::size_t>(plane)].flat_index(tile), plane)->deflated;
}

std::optional<Digest> TileLocator::digest(TileIndex tile, int plane) const {
  return paged_ ? paged_->digest(plane_tables_[static_cast<std::size_t>(plane)], tile.row, tile.column) : std::nullopt;
}

std::vector<MemberTable> TileLocator::tile_tables() const {
  std::vector<MemberTable> tables;
  for (std::size_t plane = 0; plane < grids_.size(); ++plane) {
    const TileGrid& grid = grids_[plane];
    MemberTable table;
    table.name = tile_table_name(static_cast<int>(plane));
    table.columns = grid.tile_columns();
    table.rows = grid.tile_rows();
    for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
      const TileEntry entry = record(grid.tile_at(flat), static_cast<int>(plane));
      if (!entry.stored) continue;
      widen(entry, table.stored == 0, table.code_min, table.code_max);
      table.has_voids |= entry.has_voids;
      table.compressed_bytes += entry.compressed_bytes;
      ++table.stored;
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

void TileLocator::check_against(const ArchiveDirectory& directory, const Complain& complain) const {
  struct Member {
    std::uint64_t flat;
    const ZipEntry* entry;
    std::uint64_t data_offset;
  };
  const std::vector<TableDescription>& tables = paged_->tables();
  std::vector<std::vector<Member>> members(tables.size());
  for (const ArchiveDirectory::Tile& tile : directory.tiles)
    members[plane_tables_[static_cast<std::size_t>(tile.plane)]].push_back(
        {static_cast<std::uint64_t>(tile.flat), &tile.entry, tile.data_offset});
  for (const ArchiveDirectory::Member& member : directory.members) {
    // What stands behind the index was added by another tool.
    if (member.data_offset > data_end_) continue;
    const auto place = table_place(member.entry.name);
    const auto table = place ? paged_->find_table(place->table) : std::nullopt;
    if (table)
      members[*table].push_back(
          {static_cast<std::uint64_t>(place->row * tables[*table].members.columns + place->column), &member.entry,
           member.data_offset});
  }
  const auto by_flat = [](const Member& a, const Member& b) { return a.flat < b.flat; };
  for (std::size_t table = 0; table < tables.size(); ++table) {
    std::sort(members[table].begin(), members[table].end(), by_flat);
    auto listed = members[table].begin();
    const auto not_indexed = [&](const Member& member) {
      complain(fmt::format("{}: the directory has it, the index has not", isohf::describe(*member.entry)));
    };
    paged_->for_each(
        table,
        [&](std::uint64_t flat, const TableRecord& record) {
          for (; listed != members[table].end() && listed->flat < flat; ++listed) not_indexed(*listed);
          const MemberTable& of = tables[table].members;
          const auto columns = static_cast<std::uint64_t>(of.columns);
          if (listed == members[table].end() || listed->flat != flat) {
            complain(fmt::format("member \"{}\": the index has it, the directory has not",
                                 member_name(of.name, static_cast<std::int64_t>(flat / columns),
                                             static_cast<std::int64_t>(flat % columns))));
            return;
          }
          const ZipEntry& entry = *listed->entry;
          const TileEntry& stated = record.entry;
          if (stated.offset_bytes != listed->data_offset || stated.compressed_bytes != entry.compressed_bytes ||
              stated.payload_bytes != entry.bytes || stated.payload_crc32 != entry.crc32 ||
              record.deflated != (entry.method == ZipMethod::kDeflated)) {
            complain(fmt::format("{}: index and directory do not agree", isohf::describe(entry)));
          }
          ++listed;
        },
        complain);
    for (; listed != members[table].end(); ++listed) not_indexed(*listed);
  }
}

}  // namespace isohf
