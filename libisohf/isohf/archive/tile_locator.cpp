#include "isohf/archive/tile_locator.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "isohf/archive/codec/tile_payload.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile_index.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// A grid of so many tiles may be stated where there is no index, and some for each tile that is there.
constexpr std::uint64_t kMostTilesOnTrust = std::uint64_t{1} << 16U;

}  // namespace

TileLocator::TileLocator(const ByteSource& file, const ZipEnd& end, const Metadata& metadata, bool keeps_index)
    : file_(file), end_(end), metadata_(metadata) {
  if (!use_index(keeps_index)) use_directory();
}

/// Takes the index where it and the directory agree.
bool TileLocator::use_index(bool keeps_index) {
  const auto tiles = static_cast<std::uint64_t>(metadata_.grid.tile_count());
  const std::uint64_t records_bytes = tiles * kIndexRecordBytes;
  if (end_.directory_offset < records_bytes + kIndexFooterBytes) return false;
  const std::uint64_t footer_offset = end_.directory_offset - kIndexFooterBytes;
  const auto footer = parse_index_footer(SourceBytes(file_, footer_offset, kIndexFooterBytes).bytes());
  if (!footer || footer->record_count != tiles || footer->directory_bytes >= end_.directory_bytes ||
      footer->directory_entries + 1 != end_.entries) {
    return false;
  }
  data_end_ = footer_offset - records_bytes;
  SourceBytes kept;
  if (keeps_index) kept = SourceBytes(file_, data_end_, records_bytes);
  if ((keeps_index ? crc32(kept.bytes()) : crc32_in(file_, data_end_, records_bytes)) != footer->records_crc32)
    return false;
  if (crc32_in(file_, end_.directory_offset, footer->directory_bytes) != footer->directory_crc32) return false;
  index_ = std::move(kept);
  stored_count_ = footer->stored_count;
  return true;
}

void TileLocator::use_directory() {
  by_directory_ = true;
  data_end_ = end_.directory_offset;
  const ArchiveDirectory directory = read_directory(
      file_, end_, metadata_.grid, [](const std::string& what) { throw Error(ErrorCode::kCorrupt, what); });
  const bool is_float = metadata_.quantisation.type == CodeType::kF32;
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
    entry.has_voids = true;  // what is not known without decoding: the widest range
    entry.code_min = is_float ? 0xff800000U : 0U;
    entry.code_max = is_float ? 0x7f800000U : metadata_.quantisation.max_code();
    listed_.push_back({tile.flat, entry, tile.entry.method == ZipMethod::kDeflated});
  }
  take_ranges_from_index(directory);
}

/// A repacked archive still has its old index as a member: what it says of tiles that are the same is true.
void TileLocator::take_ranges_from_index(const ArchiveDirectory& directory) {
  const auto member = std::find_if(directory.members.begin(), directory.members.end(),
                                   [](const ArchiveDirectory::Member& m) { return m.entry.name == kIndexName; });
  const auto tiles = static_cast<std::uint64_t>(metadata_.grid.tile_count());
  if (member == directory.members.end() || member->entry.bytes != tiles * kIndexRecordBytes + kIndexFooterBytes) {
    // Without an index as large, the metadata's word alone stands for the grid: going through it must have an end.
    if (tiles <= kMostTilesOnTrust + kMostTilesOnTrust / 16 * listed_.size()) return;
    throw Error(ErrorCode::kCorrupt,
                fmt::format("metadata: tiles: {}x{} are stated, {} are there, and no index of as many",
                            metadata_.grid.tile_columns(), metadata_.grid.tile_rows(), listed_.size()));
  }
  std::vector<std::byte> old;
  try {
    old = member_from(file_, member->entry, member->data_offset);
  } catch (const Error&) {
    return;  // tiles are read without it
  }
  for (Listed& tile : listed_) {
    const auto at = static_cast<std::size_t>(tile.flat) * kIndexRecordBytes;
    const auto found = parse_index_record(std::span(old).subspan(at, kIndexRecordBytes));
    if (!found || !found->stored || found->payload_crc32 != tile.entry.payload_crc32 ||
        found->payload_bytes != tile.entry.payload_bytes) {
      continue;
    }
    tile.entry.code_min = found->code_min;
    tile.entry.code_max = found->code_max;
    tile.entry.has_voids = found->has_voids;
  }
}

const TileLocator::Listed* TileLocator::find_listed(std::int64_t flat) const {
  const auto found = std::lower_bound(listed_.begin(), listed_.end(), flat,
                                      [](const Listed& tile, std::int64_t wanted) { return tile.flat < wanted; });
  return found != listed_.end() && found->flat == flat ? &*found : nullptr;
}

TileEntry TileLocator::record(std::int64_t flat) const {
  if (by_directory_) {
    const Listed* const tile = find_listed(flat);
    return tile == nullptr ? TileEntry{} : tile->entry;
  }
  const std::uint64_t at = static_cast<std::uint64_t>(flat) * kIndexRecordBytes;
  std::array<std::byte, kIndexRecordBytes> bytes{};
  const auto kept = index_.bytes();
  if (kept.empty()) {
    read_exactly(file_, data_end_ + at, bytes);
  } else {
    std::copy_n(kept.begin() + static_cast<std::ptrdiff_t>(at), bytes.size(), bytes.begin());
  }
  const auto entry = parse_index_record(bytes);
  if (!entry) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("member \"{}\" at byte {}: the record of tile {} has reserved bits set", kIndexName,
                            data_end_ + at, flat));
  }
  return *entry;
}

TileEntry TileLocator::checked_record(TileIndex tile) const {
  const TileEntry entry = record(metadata_.grid.flat_index(tile));
  if (!entry.stored) return entry;
  const auto refuse = [&](const std::string& why) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("tile ({},{}) at byte {}: {}", tile.column, tile.row, entry.offset_bytes, why));
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

bool TileLocator::is_deflated(TileIndex tile) const {
  return !by_directory_ || find_listed(metadata_.grid.flat_index(tile))->deflated;
}

void TileLocator::check_against(const ArchiveDirectory& directory, const Complain& complain) const {
  auto tile = directory.tiles.begin();
  std::uint64_t stored = 0;
  for (std::int64_t flat = 0; flat < metadata_.grid.tile_count(); ++flat) {
    const TileIndex index = metadata_.grid.tile_at(flat);
    const TileEntry entry = record(flat);
    const bool is_listed = tile != directory.tiles.end() && tile->flat == flat;
    stored += entry.stored ? 1 : 0;
    if (entry.stored != is_listed) {
      complain(fmt::format(
          "tile ({},{}): {}", index.column, index.row,
          is_listed ? "the directory has it, the index has not" : "the index has it, the directory has not"));
    } else if (is_listed &&
               (entry.offset_bytes != tile->data_offset || entry.compressed_bytes != tile->entry.compressed_bytes ||
                entry.payload_bytes != tile->entry.bytes || entry.payload_crc32 != tile->entry.crc32)) {
      complain(fmt::format("tile ({},{}) at byte {}: index and directory do not agree", index.column, index.row,
                           tile->data_offset));
    }
    while (tile != directory.tiles.end() && tile->flat == flat) ++tile;
  }
  if (stored != stored_count_) {
    complain(fmt::format("member \"{}\": its footer counts {} stored tiles, its records {}", kIndexName, stored_count_,
                         stored));
  }
}

}  // namespace isohf
