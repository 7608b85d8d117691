#include "isohf/archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "isohf/archive/archive_index.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/structure_check.h"
#include "isohf/archive/tile/quantise.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// A source of which the tail is fetched first, and what stands before a longer directory: all lies there that opening
/// reads, and of an archive that is not large all of the index that is asked for later.
class TailFirst final : public ByteSource {
 public:
  explicit TailFirst(const ByteSource& source)
      : source_(source), has_view_(source.size_bytes() == 0 || !source.view(0, 1).empty()) {
    if (!has_view_) fetch(source.size_bytes());
  }

  /// Fetches the bytes before `end_offset`, unless they are there.
  void fetch(std::uint64_t end_offset) {
    const std::uint64_t begin = end_offset - std::min(end_offset, kPieceBytes);
    if (has_view_ || (!pieces_.empty() && begin >= pieces_.back().first)) return;
    const std::uint64_t end = pieces_.empty() ? end_offset : std::min(end_offset, pieces_.back().first);
    if (begin < end) pieces_.emplace_back(begin, SourceBytes(source_, begin, end - begin));
  }

  [[nodiscard]] std::uint64_t size_bytes() const override { return source_.size_bytes(); }
  [[nodiscard]] std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    std::size_t done = 0;
    for (auto piece = pieces_.rbegin(); piece != pieces_.rend() && done < out.size(); ++piece) {
      const std::uint64_t at = offset_bytes + done;
      const auto bytes = piece->second.bytes();
      if (at < piece->first || at - piece->first >= bytes.size()) continue;
      const auto found = bytes.subspan(at - piece->first);
      const std::size_t count = std::min(found.size(), out.size() - done);
      std::copy_n(found.begin(), count, out.begin() + static_cast<std::ptrdiff_t>(done));
      done += count;
    }
    return done > 0 ? done : source_.read(offset_bytes, out);
  }
  [[nodiscard]] std::span<const std::byte> view(std::uint64_t offset_bytes, std::size_t size_bytes) const override {
    return source_.view(offset_bytes, size_bytes);
  }

 private:
  static constexpr std::uint64_t kPieceBytes = std::uint64_t{256} << 10U;

  const ByteSource& source_;
  bool has_view_;
  std::vector<std::pair<std::uint64_t, SourceBytes>> pieces_;  ///< by offset, the last of the file first
};

MemberEntry member_entry(const ZipEntry& entry, std::uint64_t data_offset) {
  return {entry.name,  data_offset, entry.compressed_bytes,
          entry.bytes, entry.crc32, entry.method == ZipMethod::kDeflated};
}

std::shared_ptr<const ByteSource> required(std::shared_ptr<const ByteSource> source, const std::string& name) {
  if (source) return source;
  throw Error(ErrorCode::kInvalidArgument, name + ": there is no source of its bytes");
}

}  // namespace

struct ArchiveReader::State {
  State(std::shared_ptr<const ByteSource> bytes, const std::string& its_name);

  std::shared_ptr<const ByteSource> source;
  TailFirst file;
  std::string name;
  ZipEnd end;
  OwnEntries own;
  std::string json;
  std::optional<Metadata> metadata;
  std::vector<Warning> warnings;
  std::optional<ArchiveIndex> index;
  /// Members in file order, and by name.
  struct Members {
    std::once_flag read;
    std::vector<MemberEntry> all;
    std::unordered_map<std::string_view, std::size_t> by_name;

    void take(std::vector<MemberEntry> found);
    [[nodiscard]] std::optional<MemberEntry> find(const std::string& name) const;
  };
  mutable Members members;
  mutable Members loose;
  std::vector<MemberTable> tables;

  void open();
  void refuse_shard() const;
  /// A member's data, its local header held against what is stated, in one range.
  [[nodiscard]] SourceBytes checked_data(const ZipMember& member, std::uint64_t data_offset,
                                         std::size_t& header_bytes) const;
  [[nodiscard]] std::vector<std::byte> payload(const TableRecord& record, TileIndex tile, int plane) const;
  void require(TileIndex tile, int plane) const;
  /// Errors of reading with the archive's name.
  template <typename Action>
  auto named(const Action& action) const {
    try {
      return action();
    } catch (const Error& error) {
      throw error.within(name);
    }
  }
  void read_members() const;
  void read_loose() const;
  [[nodiscard]] std::optional<MemberEntry> find_in_tables(const std::string& wanted) const;
};

void ArchiveReader::State::Members::take(std::vector<MemberEntry> found) {
  all = std::move(found);
  std::ranges::sort(all, {}, &MemberEntry::offset_bytes);
  for (std::size_t i = 0; i < all.size(); ++i) by_name.emplace(all[i].name, i);
}

std::optional<MemberEntry> ArchiveReader::State::Members::find(const std::string& wanted) const {
  const auto found = by_name.find(wanted);
  return found == by_name.end() ? std::nullopt : std::optional(all[found->second]);
}

ArchiveReader::State::State(std::shared_ptr<const ByteSource> bytes, const std::string& its_name) try
    : source(std::move(bytes)), file(*source), name(its_name) {
  open();
} catch (const Error& error) {
  throw error.within(its_name);
}

void ArchiveReader::State::open() {
  end = find_archive_end(file);
  file.fetch(end.directory_offset);
  own = find_own_entries(file, end);
  const ZipEntry& entry = own.metadata;
  if (entry.bytes > kMaxMetadataBytes) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} bytes, more than the {} that metadata may have",
                                                 describe(entry), entry.bytes, kMaxMetadataBytes));
  }
  // No text of metadata is worth more: memory follows what is stored, not what is claimed.
  constexpr std::uint64_t kSmallBytes = std::uint64_t{1} << 20U;
  if (entry.bytes > kSmallBytes && entry.bytes / 8 > entry.compressed_bytes) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {} bytes inflate to {}, more than eight times as many",
                                                 describe(entry), entry.compressed_bytes, entry.bytes));
  }
  const std::vector<std::byte> bytes = member_from(file, entry, checked_data_offset(file, entry));
  json.assign(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    metadata.emplace(parse_metadata(json));
  } catch (const Error& error) {
    throw error.within(fmt::format("at byte {}", entry.header_offset));
  }
  json.erase(json.find_last_not_of(" \n") + 1);
  index.emplace(file, end, own, *metadata);
  for (const TableDescription& table : index->tables().tables()) tables.push_back(table.members);
  if (index->by_directory()) {
    warnings.emplace_back("index and ZIP directory do not agree, as after repacking; tiles are found by the directory");
  }
}

void ArchiveReader::State::refuse_shard() const {
  named([&] {
    if (const auto shard = shard_record(*metadata)) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("is shard {} of {}; merge the shards first: isohf merge SHARD... -o OUTPUT",
                              shard->number, shard->count));
    }
  });
}

SourceBytes ArchiveReader::State::checked_data(const ZipMember& member, std::uint64_t data_offset,
                                               std::size_t& header_bytes) const {
  std::vector<std::byte> header;
  if (!index->by_directory()) append_local_header(member, header);
  header_bytes = static_cast<std::size_t>(std::min<std::uint64_t>(header.size(), data_offset));
  SourceBytes stored(file, data_offset - header_bytes, header_bytes + member.compressed_bytes);
  // The local header must say what the index says, or the offset is not the member's.
  if (header_bytes < header.size() || !std::equal(header.begin(), header.end(), stored.bytes().begin())) {
    throw Error(ErrorCode::kCorrupt, "its local header does not say what the index says");
  }
  return stored;
}

std::vector<std::byte> ArchiveReader::State::payload(const TableRecord& record, TileIndex tile, int plane) const {
  const TileEntry& entry = record.entry;
  std::size_t header_bytes = 0;
  const SourceBytes stored = checked_data({tile_name(tile, plane), ZipMethod::kDeflated, entry.payload_crc32,
                                           entry.compressed_bytes, entry.payload_bytes, 0},
                                          entry.offset_bytes, header_bytes);
  const auto data = stored.bytes().subspan(header_bytes);
  std::vector<std::byte> bytes;
  if (record.deflated) {
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
  std::vector<MemberEntry> found;
  for_each_member(file, end, Tiles::kPassedBy, [&](const ZipEntry& entry, std::uint64_t data_offset) {
    found.push_back(member_entry(entry, data_offset));
  });
  members.take(std::move(found));
}

void ArchiveReader::State::read_loose() const {
  std::vector<MemberEntry> found;
  if (!index->by_directory() && own.are_last && end.entries == index->tables().footer().in_tables + 3) {
    // What every archive has: media type, index, metadata.
    ZipEntry first;
    first.name = kMediaTypeName;
    first.compressed_bytes = first.bytes = kMediaType.size();
    first.crc32 = crc32(std::as_bytes(std::span(kMediaType)));
    for (const ZipEntry& entry : {first, *own.index, own.metadata})
      found.push_back(member_entry(entry, checked_data_offset(file, entry)));
  } else {
    for (ZipEntries entries(file, end); const auto entry = entries.next();) {
      if (is_in_tile_folder(entry->name) || entry->name.ends_with('/')) continue;
      if (find_in_tables(entry->name)) continue;
      found.push_back(member_entry(*entry, checked_data_offset(file, *entry)));
    }
  }
  loose.take(std::move(found));
}

std::optional<MemberEntry> ArchiveReader::State::find_in_tables(const std::string& wanted) const {
  const PagedIndex& paged = index->tables();
  const auto place = table_place(wanted);
  const auto table = place ? paged.find_table(place->table) : std::nullopt;
  if (!table) return std::nullopt;
  const MemberTable& members_of = paged.tables()[*table].members;
  if (place->column >= members_of.columns || place->row >= members_of.rows) return std::nullopt;
  const auto record = paged.record(*table, place->row, place->column);
  if (!record) return std::nullopt;
  const TileEntry& entry = record->entry;
  return MemberEntry{
      wanted, entry.offset_bytes, entry.compressed_bytes, entry.payload_bytes, entry.payload_crc32, record->deflated};
}

ArchiveReader::ArchiveReader(const std::string& path, Shards shards)
    : state_(std::make_unique<State>(open_file_source(path), path)) {
  if (shards == Shards::kRefused) state_->refuse_shard();
}

ArchiveReader::ArchiveReader(std::shared_ptr<const ByteSource> source, const std::string& name, Shards shards)
    : state_(std::make_unique<State>(required(std::move(source), name), name)) {
  if (shards == Shards::kRefused) state_->refuse_shard();
}

ArchiveReader::ArchiveReader(ArchiveReader&&) noexcept = default;
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
void ArchiveReader::set_world_map(std::shared_ptr<const ReferenceMap> map) {
  if (state_->metadata->projection) state_->metadata->projection->spec.map = std::move(map);
}
const std::string& ArchiveReader::metadata_json() const {
  return state_->json;
}
bool ArchiveReader::reads_by_directory() const {
  return state_->index->by_directory();
}
const std::vector<Warning>& ArchiveReader::warnings() const {
  return state_->warnings;
}

void ArchiveReader::State::require(TileIndex tile, int plane) const {
  if (plane < 0 || plane > metadata->planes.count) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has {} coarse planes, plane {} is asked for", name, metadata->planes.count, plane));
  }
  const TileGrid& grid = index->grids()[static_cast<std::size_t>(plane)];
  if (!grid.contains(tile)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("tile ({},{}) lies outside the grid of {}x{}", tile.column,
                                                         tile.row, grid.tile_columns(), grid.tile_rows()));
  }
}

TileEntry ArchiveReader::tile_entry(TileIndex tile, int plane) const {
  state_->require(tile, plane);
  return state_->named([&] { return state_->index->checked_record(tile, plane).entry; });
}

std::optional<std::array<std::byte, 32>> ArchiveReader::tile_digest(TileIndex tile, int plane) const {
  state_->require(tile, plane);
  return state_->named([&] { return state_->index->digest(tile, plane); });
}

const std::vector<MemberTable>& ArchiveReader::tables() const {
  return state_->tables;
}

const std::vector<MemberEntry>& ArchiveReader::loose_members() const {
  state_->named([&] { std::call_once(state_->loose.read, [&] { state_->read_loose(); }); });
  return state_->loose.all;
}

std::optional<MemberEntry> ArchiveReader::find_member(const std::string& name) const {
  if (auto found = state_->named([&] { return state_->find_in_tables(name); })) return found;
  static_cast<void>(loose_members());
  return state_->loose.find(name);
}

const std::vector<MemberEntry>& ArchiveReader::members() const {
  state_->named([&] { std::call_once(state_->members.read, [&] { state_->read_members(); }); });
  return state_->members.all;
}

TileCodes ArchiveReader::read_tile(TileIndex tile, int plane) const {
  state_->require(tile, plane);
  const TableRecord record = state_->named([&] { return state_->index->checked_record(tile, plane); });
  const CodeType type = metadata().quantisation.type;
  const TileShape& shape = grid().shape();
  if (!record.entry.stored) return void_tile(shape, metadata().quantisation);
  try {
    return decode_tile(shape, type, state_->payload(record, tile, plane));
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: {}tile ({},{}) at byte {}", path(),
                                   plane == 0 ? "" : fmt::format("plane {}: ", plane), tile.column, tile.row,
                                   record.entry.offset_bytes));
  }
}

std::vector<double> ArchiveReader::read_elevations(TileIndex tile, int plane) const {
  return elevations_of(read_tile(tile, plane), metadata().quantisation);
}

std::optional<std::vector<std::byte>> ArchiveReader::read_member(const std::string& name) const {
  const auto member = find_member(name);
  return member ? std::optional(read_member(*member)) : std::nullopt;
}

std::vector<std::byte> ArchiveReader::read_member(const MemberEntry& member) const {
  ZipEntry entry;
  entry.name = member.name;
  entry.method = member.deflated ? ZipMethod::kDeflated : ZipMethod::kStored;
  entry.crc32 = member.crc32;
  entry.compressed_bytes = member.compressed_bytes;
  entry.bytes = member.bytes;
  entry.header_offset = member.offset_bytes;
  return state_->named([&] {
    if (!state_->find_in_tables(member.name)) return member_from(state_->file, entry, member.offset_bytes);
    // Found without the directory: the member's local header has not been looked at yet.
    std::size_t header_bytes = 0;
    const SourceBytes stored = state_->checked_data(entry, member.offset_bytes, header_bytes);
    return member_from(stored.bytes().subspan(header_bytes), entry);
  });
}

std::vector<std::string> ArchiveReader::check_structure() const {
  std::vector<std::string> found(state_->warnings.begin(), state_->warnings.end());
  const Complain complain = [&](const std::string& what) { found.push_back(what); };
  isohf::check_structure(state_->file, *this, complain, complain);
  return found;
}

}  // namespace isohf
