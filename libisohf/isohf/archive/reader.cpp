#include "isohf/archive/reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <mutex>

#include "isohf/archive/deflate.h"
#include "isohf/archive/directory.h"
#include "isohf/archive/lane_decoder.h"
#include "isohf/archive/tile_index.h"
#include "isohf/archive/tile_payload.h"
#include "isohf/archive/zip_layout.h"
#include "isohf/base/error.h"
#include "isohf/base/file.h"

namespace isohf {
namespace {

/// The first entry of that name; nullopt where there is none.
std::optional<ZipEntry> find_entry(std::span<const std::byte> file, const ZipEnd& end, std::string_view name) {
  std::optional<ZipEntry> found;
  for_each_entry(file, end, [&](const ZipEntry& entry) {
    if (!found && entry.name == name) found = entry;
  });
  return found;
}

/// The metadata's entry: the first of the directory in every archive of ours, searched for in others.
ZipEntry metadata_entry(std::span<const std::byte> file, const ZipEnd& end) {
  std::optional<ZipEntry> entry;
  if (end.entries > 0) entry = first_entry(file, end);
  if (!entry || entry->name != kMetadataName) entry = find_entry(file, end, kMetadataName);
  if (!entry) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("is a ZIP file, but no isohf archive: it has no member \"{}\"", kMetadataName));
  }
  if (entry->bytes > kMaxMetadataBytes) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} bytes, more than the {} that metadata may have",
                                                 describe(*entry), entry->bytes, kMaxMetadataBytes));
  }
  return *entry;
}

}  // namespace

struct ArchiveReader::State {
  explicit State(const std::string& path) : mapped(path), file(mapped.bytes()) {}

  /// A tile as the directory has it.
  struct Listed {
    std::int64_t flat;
    TileEntry entry;
    bool deflated;
  };

  MappedFile mapped;
  std::span<const std::byte> file;
  ZipEnd end;
  std::string json;
  std::optional<Metadata> metadata;
  std::vector<std::string> warnings;
  bool by_directory = false;
  std::vector<Listed> listed;  ///< with `by_directory`: its tiles, by flat index
  std::uint64_t data_end = 0;  ///< tiles lie before it; without `by_directory` the index begins there
  mutable std::once_flag members_read;
  mutable std::vector<MemberEntry> members;

  void open();
  [[nodiscard]] bool use_index();
  void use_directory();
  void take_ranges_from_index(const Directory& directory);
  [[nodiscard]] const Listed* find_listed(std::int64_t flat) const;
  [[nodiscard]] TileEntry record(std::int64_t flat) const;
  [[nodiscard]] TileEntry checked_record(std::int64_t flat, TileIndex tile) const;
  [[nodiscard]] std::vector<std::byte> read(std::uint64_t offset_bytes, std::uint64_t size_bytes) const;
  [[nodiscard]] std::vector<std::byte> member(const ZipEntry& entry, std::uint64_t data_offset) const;
  [[nodiscard]] std::vector<std::byte> payload(const TileEntry& entry, TileIndex tile) const;
  void read_members() const;
  void check_against_index(const Directory& directory, const Complain& complain) const;
};

/// Not through the map: a file that was cut after it was opened is an error, not the end of the process.
std::vector<std::byte> ArchiveReader::State::read(std::uint64_t offset_bytes, std::uint64_t size_bytes) const {
  std::vector<std::byte> bytes(size_bytes);
  mapped.read(offset_bytes, bytes);
  return bytes;
}

std::vector<std::byte> ArchiveReader::State::member(const ZipEntry& entry, std::uint64_t data_offset) const {
  return member_from(read(data_offset, entry.compressed_bytes), entry);
}

void ArchiveReader::State::open() {
  end = find_zip_end(file);
  const ZipEntry entry = metadata_entry(file, end);
  const std::vector<std::byte> bytes = member(entry, checked_data_offset(file, entry));
  json.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    metadata.emplace(parse_metadata(json));
  } catch (const Error& error) {
    throw error.within(fmt::format("at byte {}", entry.header_offset));
  }
  json.erase(json.find_last_not_of(" \n") + 1);
  if (!use_index()) use_directory();
}

/// Takes the index where it and the directory agree.
bool ArchiveReader::State::use_index() {
  const auto tiles = static_cast<std::uint64_t>(metadata->grid.tile_count());
  const std::uint64_t bytes = tiles * kIndexRecordBytes + kIndexFooterBytes;
  if (end.directory_offset < bytes) return false;
  const std::uint64_t start = end.directory_offset - bytes;
  const auto footer = parse_index_footer(file.subspan(end.directory_offset - kIndexFooterBytes, kIndexFooterBytes));
  if (!footer || footer->record_count != tiles || footer->directory_bytes >= end.directory_bytes ||
      footer->directory_entries + 1 != end.entries) {
    return false;
  }
  const auto found = file.subspan(start, tiles * kIndexRecordBytes);
  if (crc32(found) != footer->records_crc32) return false;
  const auto directory = file.subspan(end.directory_offset, footer->directory_bytes);
  if (crc32(directory) != footer->directory_crc32) return false;
  data_end = start;
  return true;
}

void ArchiveReader::State::use_directory() {
  by_directory = true;
  data_end = end.directory_offset;
  const Directory directory = read_directory(file, end, metadata->grid,
                                             [](const std::string& what) { throw Error(ErrorCode::kCorrupt, what); });
  const bool is_float = metadata->quantisation.type == CodeType::kF32;
  for (const Directory::Tile& tile : directory.tiles) {
    if (tile.entry.method != 0 && tile.entry.method != 8) {
      throw Error(ErrorCode::kUnsupported, fmt::format("{}: compression method {}, only 0 and 8 are read",
                                                       describe(tile.entry), tile.entry.method));
    }
    TileEntry entry;
    entry.stored = true;
    entry.offset_bytes = tile.data_offset;
    entry.compressed_bytes = static_cast<std::uint32_t>(tile.entry.compressed_bytes);
    entry.payload_bytes = static_cast<std::uint32_t>(tile.entry.bytes);
    entry.payload_crc32 = tile.entry.crc32;
    entry.has_voids = true;  // what is not known without decoding: the widest range
    entry.code_min = is_float ? 0xff800000U : 0U;
    entry.code_max = is_float ? 0x7f800000U : metadata->quantisation.max_code();
    listed.push_back({tile.flat, entry, tile.entry.method == 8});
  }
  take_ranges_from_index(directory);
  warnings.emplace_back("index and ZIP directory do not agree, as after repacking; tiles are found by the directory");
}

/// A repacked archive still has its old index as a member: what it says of tiles that are the same is true.
void ArchiveReader::State::take_ranges_from_index(const Directory& directory) {
  const auto member = std::find_if(directory.members.begin(), directory.members.end(),
                                   [](const Directory::Member& m) { return m.entry.name == kIndexName; });
  const auto tiles = static_cast<std::uint64_t>(metadata->grid.tile_count());
  if (member == directory.members.end() || member->entry.bytes != tiles * kIndexRecordBytes + kIndexFooterBytes) return;
  std::vector<std::byte> old;
  try {
    old = this->member(member->entry, member->data_offset);
  } catch (const Error&) {
    return;  // tiles are read without it
  }
  for (Listed& tile : listed) {
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

const ArchiveReader::State::Listed* ArchiveReader::State::find_listed(std::int64_t flat) const {
  const auto found = std::lower_bound(listed.begin(), listed.end(), flat,
                                      [](const Listed& tile, std::int64_t wanted) { return tile.flat < wanted; });
  return found != listed.end() && found->flat == flat ? &*found : nullptr;
}

TileEntry ArchiveReader::State::record(std::int64_t flat) const {
  if (by_directory) {
    const Listed* const tile = find_listed(flat);
    return tile == nullptr ? TileEntry{} : tile->entry;
  }
  const std::uint64_t at = static_cast<std::uint64_t>(flat) * kIndexRecordBytes;
  std::array<std::byte, kIndexRecordBytes> bytes{};
  mapped.read(data_end + at, bytes);
  const auto entry = parse_index_record(bytes);
  if (!entry) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("member \"{}\" at byte {}: the record of tile {} has reserved bits set", kIndexName,
                            data_end + at, flat));
  }
  return *entry;
}

TileEntry ArchiveReader::State::checked_record(std::int64_t flat, TileIndex tile) const {
  const TileEntry entry = record(flat);
  if (!entry.stored) return entry;
  const auto refuse = [&](const std::string& why) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("tile ({},{}) at byte {}: {}", tile.column, tile.row, entry.offset_bytes, why));
  };
  if (entry.offset_bytes > data_end || entry.compressed_bytes > data_end - entry.offset_bytes) {
    refuse(fmt::format("its {} bytes reach past byte {}", entry.compressed_bytes, data_end));
  }
  const std::uint64_t most = max_payload_bytes(metadata->grid.shape(), metadata->quantisation.type);
  if (entry.payload_bytes > most) {
    refuse(fmt::format("states a payload of {} bytes, a tile of this shape has at most {}", entry.payload_bytes, most));
  }
  return entry;
}

std::vector<std::byte> ArchiveReader::State::payload(const TileEntry& entry, TileIndex tile) const {
  const bool is_deflated = !by_directory || find_listed(metadata->grid.flat_index(tile))->deflated;
  std::vector<std::byte> header;
  if (!by_directory) {
    append_local_header(
        {tile_name(tile), ZipMethod::kDeflated, entry.payload_crc32, entry.compressed_bytes, entry.payload_bytes, 0},
        header);
  }
  const std::uint64_t before = std::min<std::uint64_t>(header.size(), entry.offset_bytes);
  const std::vector<std::byte> stored = read(entry.offset_bytes - before, before + entry.compressed_bytes);
  // The local header must say what the index says, or the offset is not a tile's.
  if (before < header.size() || !std::equal(header.begin(), header.end(), stored.begin())) {
    throw Error(ErrorCode::kCorrupt, "its local header does not say what the index says");
  }
  const auto data = std::span(stored).subspan(before);
  std::vector<std::byte> bytes;
  if (is_deflated) {
    bytes.resize(entry.payload_bytes);
    inflate_exactly(data, bytes);
  } else {
    if (entry.payload_bytes != entry.compressed_bytes)
      throw Error(ErrorCode::kCorrupt, "is stored, but states two sizes");
    bytes.assign(data.begin(), data.end());
  }
  if (const std::uint32_t found = crc32(bytes); found != entry.payload_crc32) {
    throw Error(ErrorCode::kCorrupt, fmt::format("its CRC-32 is {:08x}, {:08x} is stated", found, entry.payload_crc32));
  }
  return bytes;
}

void ArchiveReader::State::read_members() const {
  mapped.check_size();
  const Directory directory =
      read_directory(file, end, std::nullopt, [](const std::string& what) { throw Error(ErrorCode::kCorrupt, what); });
  std::vector<MemberEntry> found;
  for (const Directory::Member& member : directory.members) {
    found.push_back({std::string(member.entry.name), member.data_offset, member.entry.compressed_bytes,
                     member.entry.bytes, member.entry.crc32, member.entry.method == 8});
  }
  members = std::move(found);
}

void ArchiveReader::State::check_against_index(const Directory& directory, const Complain& complain) const {
  auto tile = directory.tiles.begin();
  for (std::int64_t flat = 0; flat < metadata->grid.tile_count(); ++flat) {
    const TileIndex index = metadata->grid.tile_at(flat);
    const TileEntry entry = record(flat);
    const bool is_listed = tile != directory.tiles.end() && tile->flat == flat;
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
}

ArchiveReader::ArchiveReader(const std::string& path) : state_(std::make_unique<State>(path)) {
  try {
    state_->open();
  } catch (const Error& error) {
    throw error.within(path);
  }
}

ArchiveReader::~ArchiveReader() = default;

const std::string& ArchiveReader::path() const {
  return state_->mapped.path();
}
std::uint64_t ArchiveReader::size_bytes() const {
  return state_->file.size();
}
const Metadata& ArchiveReader::metadata() const {
  return *state_->metadata;
}
const std::string& ArchiveReader::metadata_json() const {
  return state_->json;
}
bool ArchiveReader::reads_by_directory() const {
  return state_->by_directory;
}
const std::vector<std::string>& ArchiveReader::warnings() const {
  return state_->warnings;
}

TileEntry ArchiveReader::tile_entry(TileIndex tile) const {
  if (!grid().contains(tile)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("tile ({},{}) lies outside the grid of {}x{}", tile.column,
                                                         tile.row, grid().tile_columns(), grid().tile_rows()));
  }
  try {
    return state_->checked_record(grid().flat_index(tile), tile);
  } catch (const Error& error) {
    throw error.within(path());
  }
}

const std::vector<MemberEntry>& ArchiveReader::members() const {
  try {
    std::call_once(state_->members_read, [&] { state_->read_members(); });
  } catch (const Error& error) {
    throw error.within(path());
  }
  return state_->members;
}

TileCodes ArchiveReader::read_tile(TileIndex tile) const {
  const TileEntry entry = tile_entry(tile);
  const CodeType type = metadata().quantisation.type;
  const TileShape& shape = grid().shape();
  if (!entry.stored) return void_tile(shape, metadata().quantisation);
  try {
    return decode_tile(shape, type, state_->payload(entry, tile));
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: tile ({},{}) at byte {}", path(), tile.column, tile.row, entry.offset_bytes));
  }
}

std::vector<TileCodes> ArchiveReader::read_tiles(std::span<const TileIndex> tiles) const {
  std::vector<TileCodes> codes(tiles.size());
  for (std::size_t begin = 0; begin < tiles.size(); begin += kDecoderLanes) {
    const std::size_t count = std::min(kDecoderLanes, tiles.size() - begin);
    std::array<std::vector<std::byte>, kDecoderLanes> payloads;
    std::array<std::span<const std::byte>, kDecoderLanes> spans;
    std::array<std::size_t, kDecoderLanes> place{};
    std::size_t lanes = 0;
    for (std::size_t i = begin; i < begin + count; ++i) {
      const TileEntry entry = tile_entry(tiles[i]);
      if (!entry.stored) {
        codes[i] = void_tile(grid().shape(), metadata().quantisation);
        continue;
      }
      try {
        payloads[lanes] = state_->payload(entry, tiles[i]);
      } catch (const Error&) {
        codes[i] = read_tile(tiles[i]);  // tells which tile and why
        continue;
      }
      spans[lanes] = payloads[lanes];
      place[lanes++] = i;
    }
    std::array<TileCodes, kDecoderLanes> decoded;
    std::array<bool, kDecoderLanes> is_decoded{};
    decode_lanes(grid().shape(), metadata().quantisation.type, std::span(spans).first(lanes),
                 std::span(decoded).first(lanes), std::span(is_decoded).first(lanes));
    for (std::size_t lane = 0; lane < lanes; ++lane) {
      const std::size_t i = place[lane];
      codes[i] = is_decoded[lane] ? std::move(decoded[lane]) : read_tile(tiles[i]);
    }
  }
  return codes;
}

bool ArchiveReader::zlib_reads(TileIndex tile) const {
  const TileEntry entry = tile_entry(tile);
  if (!entry.stored || state_->by_directory) return true;  // zipped again by another program: not our stream
  return zlib_inflates_to(state_->read(entry.offset_bytes, entry.compressed_bytes), state_->payload(entry, tile));
}

std::vector<double> ArchiveReader::read_elevations(TileIndex tile) const {
  const TileCodes codes = read_tile(tile);
  if (codes.type == CodeType::kF32) return {codes.heights.begin(), codes.heights.end()};
  const Quantisation& quantisation = metadata().quantisation;
  const std::uint32_t void_code = quantisation.void_code();
  std::vector<double> heights(codes.codes.size());
  std::transform(codes.codes.begin(), codes.codes.end(), heights.begin(), [&](std::uint16_t code) {
    return code == void_code ? std::numeric_limits<double>::quiet_NaN()
                             : quantisation.offset + quantisation.scale * code;
  });
  return heights;
}

std::optional<std::vector<std::byte>> ArchiveReader::read_member(const std::string& name) const {
  const auto& all = members();
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const MemberEntry& member) { return member.name == name; });
  if (found == all.end()) return std::nullopt;
  return read_member(*found);
}

std::vector<std::byte> ArchiveReader::read_member(const MemberEntry& member) const {
  ZipEntry entry;
  entry.name = member.name;
  entry.method = member.deflated ? 8 : 0;
  entry.crc32 = member.crc32;
  entry.compressed_bytes = member.compressed_bytes;
  entry.bytes = member.bytes;
  entry.header_offset = member.offset_bytes;
  try {
    return state_->member(entry, member.offset_bytes);
  } catch (const Error& error) {
    throw error.within(path());
  }
}

std::vector<std::string> ArchiveReader::check_structure() const {
  const State& state = *state_;
  std::vector<std::string> found = state.warnings;
  const auto complain = [&](const std::string& what) { found.push_back(what); };
  try {
    state.mapped.check_size();
    const Directory directory = read_directory(state.file, state.end, grid(), complain);
    if (!state.by_directory) {
      state.check_against_index(directory, complain);
      check_profile(state.file, state.end, complain);
    }
    for (const Directory::Member& member : directory.members) {
      static_cast<void>(state.member(member.entry, member.data_offset));
    }
  } catch (const Error& error) {
    complain(error.what());
  }
  return found;
}

}  // namespace isohf
