#include "isohf/archive.h"
#include "isohf/archive/codec/tile_decoder.h"
#include "isohf/archive/codec/tile_encoder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <mutex>

#include "isohf/archive/codec/simd/batch_decoder.h"
#include "isohf/archive/codec/tile_codes.h"
#include "isohf/archive/container/directory.h"
#include "isohf/archive/container/zip_layout.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile_table.h"
#include "isohf/base/file.h"
#include "isohf/error.h"

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

  MappedFile mapped;
  std::span<const std::byte> file;
  ZipEnd end;
  std::string json;
  std::optional<Metadata> metadata;
  std::vector<Warning> warnings;
  std::optional<TileTable> tiles;
  mutable std::once_flag members_read;
  mutable std::vector<MemberEntry> members;

  void open();
  [[nodiscard]] std::vector<std::byte> read(std::uint64_t offset_bytes, std::uint64_t size_bytes) const;
  [[nodiscard]] std::vector<std::byte> payload(const TileEntry& entry, TileIndex tile) const;
  void read_members() const;
};

/// Not through the map: a file that was cut after it was opened is an error, not the end of the process.
std::vector<std::byte> ArchiveReader::State::read(std::uint64_t offset_bytes, std::uint64_t size_bytes) const {
  std::vector<std::byte> bytes(size_bytes);
  mapped.read(offset_bytes, bytes);
  return bytes;
}

void ArchiveReader::State::open() {
  end = find_zip_end(file);
  const ZipEntry entry = metadata_entry(file, end);
  const std::vector<std::byte> bytes = member_from(mapped, entry, checked_data_offset(file, entry));
  json.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    metadata.emplace(parse_metadata(json));
  } catch (const Error& error) {
    throw error.within(fmt::format("at byte {}", entry.header_offset));
  }
  json.erase(json.find_last_not_of(" \n") + 1);
  tiles.emplace(mapped, end, *metadata);
  if (tiles->by_directory()) {
    warnings.emplace_back("index and ZIP directory do not agree, as after repacking; tiles are found by the directory");
  }
}

std::vector<std::byte> ArchiveReader::State::payload(const TileEntry& entry, TileIndex tile) const {
  std::vector<std::byte> header;
  if (!tiles->by_directory()) {
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
  if (tiles->is_deflated(tile)) {
    bytes.resize(entry.payload_bytes);
    inflate_exactly(data, bytes);
  } else {
    if (entry.payload_bytes != entry.compressed_bytes)
      throw Error(ErrorCode::kCorrupt, "is stored, but states two sizes");
    bytes.assign(data.begin(), data.end());
  }
  if (const std::uint32_t found = crc32(bytes); found != entry.payload_crc32) {
    throw Error(ErrorCode::kCorrupt, fmt::format("its CRC-32 is {:08x}, {:08x} is stated", found, entry.payload_crc32),
                {"", fmt::format("CRC-32 {:08x}", found), fmt::format("{:08x}", entry.payload_crc32), ""});
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
void ArchiveReader::set_source_map(std::shared_ptr<const ReferenceMap> map) {
  state_->metadata->source.map = std::move(map);
}
const std::string& ArchiveReader::metadata_json() const {
  return state_->json;
}
bool ArchiveReader::reads_by_directory() const {
  return state_->tiles->by_directory();
}
const std::vector<Warning>& ArchiveReader::warnings() const {
  return state_->warnings;
}

TileEntry ArchiveReader::tile_entry(TileIndex tile) const {
  if (!grid().contains(tile)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("tile ({},{}) lies outside the grid of {}x{}", tile.column,
                                                         tile.row, grid().tile_columns(), grid().tile_rows()));
  }
  try {
    return state_->tiles->checked_record(tile);
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
  for (std::size_t begin = 0; begin < tiles.size(); begin += kBatchLanes) {
    const std::size_t count = std::min(kBatchLanes, tiles.size() - begin);
    std::array<std::vector<std::byte>, kBatchLanes> payloads;
    std::array<std::span<const std::byte>, kBatchLanes> spans;
    std::array<std::size_t, kBatchLanes> place{};
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
    std::array<TileCodes, kBatchLanes> decoded;
    std::array<bool, kBatchLanes> is_decoded{};
    decode_batch(grid().shape(), metadata().quantisation.type, std::span(spans).first(lanes),
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
  if (!entry.stored || reads_by_directory()) return true;  // zipped again by another program: not our stream
  return zlib_inflates_to(state_->read(entry.offset_bytes, entry.compressed_bytes), state_->payload(entry, tile));
}

bool ArchiveReader::zlib_reads(const MemberEntry& member, std::span<const std::byte> bytes) const {
  if (!member.deflated || reads_by_directory()) return true;
  return zlib_inflates_to(state_->read(member.offset_bytes, member.compressed_bytes), bytes);
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
    return member_from(state_->mapped, entry, member.offset_bytes);
  } catch (const Error& error) {
    throw error.within(path());
  }
}

std::vector<std::string> ArchiveReader::check_structure() const {
  const State& state = *state_;
  std::vector<std::string> found(state.warnings.begin(), state.warnings.end());
  const auto complain = [&](const std::string& what) { found.push_back(what); };
  try {
    state.mapped.check_size();
    const Directory directory = read_directory(state.file, state.end, grid(), complain);
    if (!state.tiles->by_directory()) {
      state.tiles->check_against(directory, complain);
      check_profile(state.file, state.end, complain);
    }
    for (const Directory::Member& member : directory.members) {
      static_cast<void>(member_from(state.mapped, member.entry, member.data_offset));
    }
  } catch (const Error& error) {
    complain(error.what());
  }
  return found;
}

}  // namespace isohf
