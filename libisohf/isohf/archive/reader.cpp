#include "isohf/archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <mutex>
#include <utility>

#include "isohf/archive/codec/quantise.h"
#include "isohf/archive/codec/simd/batch_decoder.h"
#include "isohf/archive/codec/tile_codes.h"
#include "isohf/archive/codec/tile_decoder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile_locator.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// A source of which the two ends are fetched first, each at once: that is where all lies that opening reads.
class EndsFirst final : public ByteSource {
 public:
  explicit EndsFirst(const ByteSource& source) : source_(source), tail_offset_(source.size_bytes()) {
    if (tail_offset_ == 0 || !source.view(0, 1).empty()) return;
    tail_offset_ -= std::min(tail_offset_, kTailBytes);
    tail_ = SourceBytes(source, tail_offset_, source.size_bytes() - tail_offset_);
    head_ = SourceBytes(source, 0, std::min(tail_offset_, kHeadBytes));
  }

  /// From here on everything is read from the source.
  void forget_ends() { head_ = tail_ = {}; }

  [[nodiscard]] std::uint64_t size_bytes() const override { return source_.size_bytes(); }
  [[nodiscard]] std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    for (const auto& [bytes, begin] :
         {std::pair(head_.bytes(), std::uint64_t{0}), std::pair(tail_.bytes(), tail_offset_)}) {
      if (offset_bytes < begin || offset_bytes - begin >= bytes.size()) continue;
      const auto found = bytes.subspan(offset_bytes - begin);
      if (found.size() < out.size()) continue;
      std::copy_n(found.begin(), out.size(), out.begin());
      return out.size();
    }
    return source_.read(offset_bytes, out);
  }
  [[nodiscard]] std::span<const std::byte> view(std::uint64_t offset_bytes, std::size_t size_bytes) const override {
    return source_.view(offset_bytes, size_bytes);
  }

 private:
  static constexpr std::uint64_t kHeadBytes = std::uint64_t{32} << 10U;         // the metadata of nearly every archive
  static constexpr std::uint64_t kTailBytes = (std::uint64_t{64} << 10U) + 22;  // an end record and its comment

  const ByteSource& source_;
  std::uint64_t tail_offset_;
  SourceBytes head_;
  SourceBytes tail_;
};

/// The metadata's entry: the first of the directory in every archive of ours, searched for in others.
ZipEntry metadata_entry(const ByteSource& file, const ZipEnd& end) {
  ZipEntries entries(file, end);
  auto entry = entries.next();
  while (entry && entry->name != kMetadataName) entry = entries.next();
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
  State(std::shared_ptr<const ByteSource> bytes, const std::string& its_name, bool keeps_index);

  std::shared_ptr<const ByteSource> source;
  EndsFirst file;
  std::string name;
  ZipEnd end;
  std::string json;
  std::optional<Metadata> metadata;
  std::vector<Warning> warnings;
  std::optional<TileLocator> tiles;
  mutable std::once_flag members_read;
  mutable std::vector<MemberEntry> members;

  void open(bool keeps_index);
  [[nodiscard]] std::vector<std::byte> payload(const TileEntry& entry, TileIndex tile) const;
  void read_members() const;
};

ArchiveReader::State::State(std::shared_ptr<const ByteSource> bytes, const std::string& its_name, bool keeps_index) try
    : source(std::move(bytes)), file(*source), name(its_name) {
  open(keeps_index);
} catch (const Error& error) {
  throw error.within(its_name);
}

void ArchiveReader::State::open(bool keeps_index) {
  end = find_archive_end(file);
  const ZipEntry entry = metadata_entry(file, end);
  const std::vector<std::byte> bytes = member_from(file, entry, checked_data_offset(file, entry));
  json.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    metadata.emplace(parse_metadata(json));
  } catch (const Error& error) {
    throw error.within(fmt::format("at byte {}", entry.header_offset));
  }
  json.erase(json.find_last_not_of(" \n") + 1);
  tiles.emplace(file, end, *metadata, keeps_index);
  if (tiles->by_directory()) {
    warnings.emplace_back("index and ZIP directory do not agree, as after repacking; tiles are found by the directory");
  }
  file.forget_ends();
}

std::vector<std::byte> ArchiveReader::State::payload(const TileEntry& entry, TileIndex tile) const {
  std::vector<std::byte> header;
  if (!tiles->by_directory()) {
    append_local_header(
        {tile_name(tile), ZipMethod::kDeflated, entry.payload_crc32, entry.compressed_bytes, entry.payload_bytes, 0},
        header);
  }
  const std::uint64_t before = std::min<std::uint64_t>(header.size(), entry.offset_bytes);
  const SourceBytes stored(file, entry.offset_bytes - before, before + entry.compressed_bytes);
  // The local header must say what the index says, or the offset is not a tile's.
  if (before < header.size() || !std::equal(header.begin(), header.end(), stored.bytes().begin())) {
    throw Error(ErrorCode::kCorrupt, "its local header does not say what the index says");
  }
  const auto data = stored.bytes().subspan(before);
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
  const ArchiveDirectory directory =
      read_directory(file, end, std::nullopt, [](const std::string& what) { throw Error(ErrorCode::kCorrupt, what); });
  std::vector<MemberEntry> found;
  for (const auto& [entry, data_offset] : directory.members) {
    found.push_back({entry.name, data_offset, entry.compressed_bytes, entry.bytes, entry.crc32,
                     entry.method == ZipMethod::kDeflated});
  }
  members = std::move(found);
}

ArchiveReader::ArchiveReader(const std::string& path)
    : state_(std::make_unique<State>(open_file_source(path), path, false)) {}

ArchiveReader::ArchiveReader(std::shared_ptr<const ByteSource> source, const std::string& name)
    : state_(std::make_unique<State>(std::move(source), name, true)) {}

ArchiveReader::~ArchiveReader() = default;

const std::string& ArchiveReader::path() const {
  return state_->name;
}
const ByteSource& ArchiveReader::source() const {
  return *state_->source;
}
std::uint64_t ArchiveReader::size_bytes() const {
  return source().size_bytes();
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
  return zlib_inflates_to(SourceBytes(source(), entry.offset_bytes, entry.compressed_bytes).bytes(),
                          state_->payload(entry, tile));
}

bool ArchiveReader::zlib_reads(const MemberEntry& member, std::span<const std::byte> bytes) const {
  if (!member.deflated || reads_by_directory()) return true;
  return zlib_inflates_to(SourceBytes(source(), member.offset_bytes, member.compressed_bytes).bytes(), bytes);
}

std::vector<double> ArchiveReader::read_elevations(TileIndex tile) const {
  return elevations_of(read_tile(tile), metadata().quantisation);
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
  entry.method = member.deflated ? ZipMethod::kDeflated : ZipMethod::kStored;
  entry.crc32 = member.crc32;
  entry.compressed_bytes = member.compressed_bytes;
  entry.bytes = member.bytes;
  entry.header_offset = member.offset_bytes;
  try {
    return member_from(source(), entry, member.offset_bytes);
  } catch (const Error& error) {
    throw error.within(path());
  }
}

std::vector<std::string> ArchiveReader::check_structure() const {
  const State& state = *state_;
  std::vector<std::string> found(state.warnings.begin(), state.warnings.end());
  const auto complain = [&](const std::string& what) { found.push_back(what); };
  try {
    const ArchiveDirectory directory = read_directory(state.file, state.end, grid(), complain);
    if (!state.tiles->by_directory()) {
      state.tiles->check_against(directory, complain);
      check_profile(state.file, state.end, complain);
    }
    for (const auto& [entry, data_offset] : directory.members) {
      static_cast<void>(member_from(state.file, entry, data_offset));
    }
  } catch (const Error& error) {
    complain(error.what());
  }
  return found;
}

}  // namespace isohf
