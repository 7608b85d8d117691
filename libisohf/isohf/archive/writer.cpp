#include "isohf/archive/writer.h"
#include "isohf/archive/tile/tile_decoder.h"
#include "isohf/archive/tile/tile_encoder.h"

#include <fmt/format.h>
#include <oneapi/tbb/task_group.h>

#include <algorithm>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "isohf/archive/archive_index_builder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/content_hash.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/journal.h"
#include "isohf/archive/metadata/accuracy_info.h"
#include "isohf/archive/metadata/shard_record.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/base/output_file.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Bytes after which part file and journal are flushed to the disk, so that a power cut costs no more than these.
constexpr std::uint64_t kSyncBytes = std::uint64_t{256} << 20U;
constexpr std::uint64_t kJournalBytes = std::uint64_t{4} << 20U;

/// What is collected before it is written: it stays in a core's cache between the two copies.
constexpr std::size_t kBufferBytes = std::size_t{256} << 10U;

/// Of other archives' members: what is copied at once, and how many such pieces the caller may be ahead.
constexpr std::uint64_t kCopyBytes = std::uint64_t{256} << 10U;
constexpr std::size_t kMostAhead = 32;

/// Members that follow one another in another archive.
struct CopiedRun {
  CopySource from;
  std::uint64_t offset = 0;  ///< of the first one's local header
  std::uint64_t bytes = 0;
  std::vector<std::byte> headers;                                ///< as they must stand there
  std::vector<std::pair<std::uint32_t, std::uint32_t>> members;  ///< bytes of header and of data
};

Digest job_digest(const TileGrid& grid, const WriterOptions& options) {
  std::vector<std::byte> bytes;
  ByteWriter writer(bytes);
  const TileShape& shape = grid.shape();
  for (const int value : {shape.columns(), shape.rows(), shape.levels()}) writer.write(value);
  writer.write(grid.tile_columns());
  writer.write(grid.tile_rows());
  writer.write(grid.extent_x());
  writer.write(grid.extent_z());
  writer.write(options.planes.stride);
  writer.write(options.planes.count);
  writer.write_bytes(std::as_bytes(std::span<const char>(options.job_fingerprint)));
  return sha256(bytes);
}

/// Returns `path`, once what an interrupted run left there is where this run wants it.
const std::string& with_old_part_in_place(const std::string& path, const TileGrid& grid, const WriterOptions& options) {
  const std::string part = output_place(path, options.overwrite) + ".part";
  if (options.resume) {
    take_part_back(part, job_digest(grid, options));
  } else {
    put_part_aside(part);
  }
  return path;
}

}  // namespace

struct ArchiveWriter::State {
  std::string path;
  TileGrid grid;
  WriterOptions options;
  ArchiveIndexBuilder contents;
  OutputFile part;  ///< behind all that may not fit in memory
  std::string journal_path;
  std::optional<Journal> journal;
  std::uint64_t journalled = 0;  ///< bytes of the part file that the journal's file vouches for
  std::uint64_t synced = 0;
  std::string content_hash;       ///< once all tiles are there
  std::uint64_t members_end = 0;  ///< likewise: where index and directory begin
  bool finished = false;
  bool keep = false;
  CopiedRun collected;  ///< by the caller's thread
  std::mutex mutex;
  std::deque<CopiedRun> ahead;  ///< to be copied by the task
  bool has_task = false;
  std::vector<std::byte> piece;  ///< the task's
  std::uint64_t announced = 0;   ///< where the file will end; 0: nothing is being copied
  oneapi::tbb::task_group copying;

  State(const std::string& target, const TileGrid& tile_grid, const WriterOptions& writer_options)
      : path(target),
        grid(tile_grid),
        options(writer_options),
        contents(tile_grid, writer_options.planes, folder_of(target)),
        part(with_old_part_in_place(target, tile_grid, writer_options),
             {options.overwrite, options.resume, kBufferBytes}),
        journal_path(part.part_path() + ".journal") {}

  /// Errors of the output file with its name.
  template <typename Action>
  auto named(Action action) const {
    try {
      return action();
    } catch (const Error& error) {
      throw error.within(path);
    }
  }

  void start_over();
  void resume();
  /// Where the next member is to stand.
  [[nodiscard]] std::uint64_t position() const { return announced != 0 ? announced : part.position(); }
  void copy(const CopySource& from, std::uint64_t data_offset, const ZipMember& member);
  void hand_over();
  void write_ahead();
  void write_copies(const CopiedRun& run);
  void end_copies();
  void begin_contents();
  [[nodiscard]] bool is_intact(const JournalRecord& record, std::uint64_t expected_offset) const;
  void append(const ZipMember& member, std::span<const std::byte> data);
  void add_member(ZipMember member, std::span<const std::byte> data);
  void checkpoint();
  void add_tile_member(JournalRecord::Kind kind, PlaneTile tile, const EncodedTile& encoded,
                       std::pair<std::uint32_t, std::uint32_t> range);
};

/// The first member, by which the file is known for what it is.
JournalRecord media_type_record() {
  const auto data = std::as_bytes(std::span(kMediaType));
  JournalRecord record;
  record.kind = JournalRecord::Kind::kMember;
  record.member = {kMediaTypeName, ZipMethod::kStored, crc32(data), data.size(), data.size(), 0};
  record.data_crc32 = record.member.crc32;
  return record;
}

/// The first member, and the tiles that are not there.
void ArchiveWriter::State::begin_contents() {
  contents.add(media_type_record());
  contents.skip(options.first_tile);
}

void ArchiveWriter::State::start_over() {
  part.truncate(0);
  if (options.journal) journal = Journal::start(journal_path, job_digest(grid, options));
  append(media_type_record().member, std::as_bytes(std::span(kMediaType)));
  begin_contents();
}

/// True where the part file holds what the record says, at the offset that it must stand at.
bool ArchiveWriter::State::is_intact(const JournalRecord& record, std::uint64_t expected_offset) const {
  if (record.kind == JournalRecord::Kind::kEmptyTile) return true;
  if (record.member.header_offset != expected_offset) return false;
  std::vector<std::byte> header;
  append_local_header(record.member, header);
  std::vector<std::byte> found(header.size());
  if (part.read_at(expected_offset, found) != found.size() || found != header) return false;
  std::uint64_t at = expected_offset + header.size();
  std::uint32_t crc = 0;
  found.resize(std::size_t{1} << 20U);
  for (std::uint64_t left = record.member.compressed_bytes; left > 0;) {
    const auto wanted = static_cast<std::size_t>(std::min<std::uint64_t>(left, found.size()));
    if (part.read_at(at, std::span(found).first(wanted)) != wanted) return false;
    crc = crc32(std::span(found).first(wanted), crc);
    at += wanted;
    left -= wanted;
  }
  return crc == record.data_crc32;
}

void ArchiveWriter::State::resume() {
  if (part.size_on_disk() == 0) return start_over();  // whatever its journal was of
  Journal::Opened opened = Journal::open(journal_path, job_digest(grid, options));
  if (!opened.matches) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{} belongs to another input or other options; remove it to start over", part.part_path()));
  }
  const JournalRecord media_type = media_type_record();
  if (opened.records.empty() || !is_intact(media_type, 0)) {
    start_over();
    return;
  }
  const std::uint64_t head = local_header_bytes(media_type.member) + media_type.member.compressed_bytes;
  // All records that are true, then back to the last tile: what stands behind it is written again.
  std::uint64_t good_end = head;
  std::uint64_t journal_end = opened.header_bytes;
  std::uint64_t offset = head;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < opened.records.size(); ++i) {
    const JournalRecord& record = opened.records[i];
    if (!is_intact(record, offset)) break;
    if (record.kind != JournalRecord::Kind::kEmptyTile) {
      offset += local_header_bytes(record.member) + record.member.compressed_bytes;
    }
    if (record.kind == JournalRecord::Kind::kMember || record.kind == JournalRecord::Kind::kPlaneTile) continue;
    good_end = offset;
    journal_end = opened.ends[i];
    kept = i + 1;
  }
  begin_contents();
  for (std::size_t i = 0; i < kept && contents.next_tile() < grid.tile_count(); ++i) contents.add(opened.records[i]);
  part.truncate(good_end);
  journal = std::move(opened.journal);
  journal->truncate(journal_end);
  journalled = synced = good_end;
}

void ArchiveWriter::State::append(const ZipMember& member, std::span<const std::byte> data) {
  end_copies();
  try {
    std::vector<std::byte> header;
    append_local_header(member, header);
    part.append(header);
    part.append(data);
  } catch (const Error& error) {
    // What can be gone on with; copies of tiles are made anew.
    if (!journal) throw error.within(path);
    throw Error(error.code(), fmt::format("{}: {}; {} of {} tiles are done", path, error.what(), contents.next_tile(),
                                          grid.tile_count()));
  }
}

void ArchiveWriter::State::copy(const CopySource& from, std::uint64_t data_offset, const ZipMember& member) {
  ISOHF_ASSERT(!journal);
  const std::uint64_t header = local_header_bytes(member);
  const std::uint64_t bytes = header + member.compressed_bytes;
  if (data_offset < header)
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: its index names byte {}", from.name, data_offset));
  const std::uint64_t offset = data_offset - header;
  const bool follows = collected.from.bytes == from.bytes && collected.offset + collected.bytes == offset;
  if (collected.bytes > 0 && (!follows || collected.bytes + bytes > kCopyBytes)) hand_over();
  if (collected.bytes == 0) {
    collected.from = from;
    collected.offset = offset;
  }
  announced = position() + bytes;
  append_local_header(member, collected.headers);
  collected.members.emplace_back(static_cast<std::uint32_t>(header),
                                 static_cast<std::uint32_t>(member.compressed_bytes));
  collected.bytes += bytes;
}

/// Has the task copy what was collected.
void ArchiveWriter::State::hand_over() {
  if (collected.bytes == 0) return;
  bool is_idle = false;
  bool is_full = false;
  {
    const std::lock_guard lock(mutex);
    ahead.push_back(std::exchange(collected, {}));
    is_idle = !std::exchange(has_task, true);
    is_full = ahead.size() >= kMostAhead;
  }
  if (is_idle) copying.run([this] { write_ahead(); });
  if (is_full) copying.wait();
}

void ArchiveWriter::State::write_ahead() {
  for (CopiedRun run;; write_copies(run)) {
    const std::lock_guard lock(mutex);
    if (!(has_task = !ahead.empty())) return;
    run = std::move(ahead.front());
    ahead.pop_front();
  }
}

void ArchiveWriter::State::write_copies(const CopiedRun& run) {
  try {
    piece.resize(run.bytes);
    read_exactly(*run.from.bytes, run.offset, piece);
  } catch (const Error& error) {
    throw error.within(run.from.name);
  }
  std::size_t at = 0;
  auto header = run.headers.begin();
  for (const auto& [header_bytes, data_bytes] : run.members) {
    const auto found = std::span(piece).subspan(at, header_bytes);
    if (!std::equal(found.begin(), found.end(), header)) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: at byte {}: no local header that says what the index says",
                                                   run.from.name, run.offset + at));
    }
    header += header_bytes;
    contents.add_data_crc32(crc32(std::span(piece).subspan(at + header_bytes, data_bytes)));
    at += header_bytes + data_bytes;
  }
  named([&] { part.append(piece); });
}

void ArchiveWriter::State::end_copies() {
  if (announced == 0) return;
  hand_over();
  copying.wait();
  announced = 0;
}

void ArchiveWriter::State::checkpoint() {
  if (!journal || part.position() - journalled < kJournalBytes) return;
  named([&] {
    // The part file first: what the journal says is then there, as long as the machine keeps running.
    part.flush();
    if (part.position() - synced >= kSyncBytes) {
      part.sync();
      synced = part.position();
    }
    journal->flush();
  });
  journalled = part.position();
}

bool is_archive_file(const std::string& path) {
  // Its first member: a local header of 30 bytes, then the name and, where that is the media type's, its data.
  const auto starts_with = [&](const std::string& name) {
    const std::string start = std::string("PK\x03\x04") + std::string(26, '?') + name;
    const std::vector<std::byte> head = head_of_file(path, start.size());
    return head.size() == start.size() &&
           std::equal(head.begin(), head.end(), start.begin(),
                      [](std::byte is, char wanted) { return wanted == '?' || is == static_cast<std::byte>(wanted); });
  };
  return starts_with(kMediaTypeName + std::string(kMediaType)) || starts_with(kMetadataName);
}

ArchiveWriter::ArchiveWriter(const std::string& path, const TileGrid& grid, const WriterOptions& options) {
  try {
    if (!head_of_file(path, 1).empty() && !is_archive_file(path)) {
      throw Error(ErrorCode::kInvalidArgument,
                  "is no isohf archive, and only such are replaced by one; remove it first, or choose another name");
    }
    state_ = std::make_unique<State>(path, grid, options);
    options.resume ? state_->resume() : state_->start_over();
  } catch (const Error& error) {
    if (state_ != nullptr && options.resume) state_->part.keep();
    if (state_ != nullptr && !options.resume) remove_file(state_->journal_path);
    throw error.within(path);
  }
}

ArchiveWriter::~ArchiveWriter() {
  stop_copies();
  if (state_ == nullptr || state_->finished || state_->keep) return;
  remove_file(state_->journal_path);
}

std::int64_t ArchiveWriter::next_tile() const {
  return state_->contents.next_tile();
}
std::int64_t ArchiveWriter::tiles_stored() const {
  return state_->contents.tiles_stored();
}
std::uint64_t ArchiveWriter::bytes_written() const {
  return state_->position();
}
std::uint64_t ArchiveWriter::tile_bytes() const {
  return state_->contents.tile_bytes();
}
TileStatistics ArchiveWriter::statistics() const {
  return state_->contents.statistics();
}

const std::vector<double>& ArchiveWriter::row_sums() const {
  return state_->contents.row_sums();
}

MemberTotals ArchiveWriter::members_in(const std::string& folder) const {
  return state_->contents.members_in(folder);
}

void ArchiveWriter::State::add_tile_member(JournalRecord::Kind kind, PlaneTile tile, const EncodedTile& encoded,
                                           std::pair<std::uint32_t, std::uint32_t> range) {
  end_copies();
  JournalRecord record;
  record.kind = kind;
  record.digest = encoded.content_digest;
  record.statistics = encoded.statistics;
  if (kind != JournalRecord::Kind::kEmptyTile) {
    record.member = {tile_name(tile.tile, tile.plane), ZipMethod::kDeflated,  encoded.payload_crc32,
                     encoded.deflated.size(),          encoded.payload_bytes, part.position()};
    record.data_crc32 = crc32(encoded.deflated);
    record.code_min = range.first;
    record.code_max = range.second;
    record.has_voids = encoded.has_voids;
    append(record.member, encoded.deflated);
  }
  if (journal) journal->add(record);
  contents.add(record);
  checkpoint();
}

void ArchiveWriter::add_tile(const EncodedTile& tile) {
  const std::int64_t flat = state_->contents.next_tile();
  ISOHF_ASSERT(flat < state_->grid.tile_count());
  state_->add_tile_member(tile.is_empty ? JournalRecord::Kind::kEmptyTile : JournalRecord::Kind::kTile,
                          {0, state_->grid.tile_at(flat)}, tile, {tile.code_min, tile.code_max});
}

void ArchiveWriter::skip_tiles(std::int64_t tiles) {
  state_->contents.skip(tiles);
}

void ArchiveWriter::add_plane_tile(int plane, TileIndex tile, const EncodedTile& encoded,
                                   std::pair<std::uint32_t, std::uint32_t> below) {
  ISOHF_ASSERT(state_->contents.takes(tile, plane));
  if (!encoded.is_empty) state_->add_tile_member(JournalRecord::Kind::kPlaneTile, {plane, tile}, encoded, below);
}

void ArchiveWriter::State::add_member(ZipMember member, std::span<const std::byte> data) {
  const auto refuse = [&](const std::string& why) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: member \"{}\": {}", path, member.name, why));
  };
  const std::string& name = member.name;
  if (const std::string why = why_bad_name(name); !why.empty()) refuse(why);
  if (name == kMetadataName || name == kIndexName || is_in_tile_folder(name)) refuse("the name is taken");
  if (contents.has_member(name)) refuse("it is there already");
  end_copies();
  JournalRecord record;
  record.kind = JournalRecord::Kind::kMember;
  record.member = std::move(member);
  record.member.header_offset = part.position();
  record.data_crc32 = crc32(data);
  append(record.member, data);
  if (journal) journal->add(record);
  contents.add(record);
  checkpoint();
}

void ArchiveWriter::add_member(const std::string& name, std::span<const std::byte> bytes, bool deflate) {
  std::vector<std::byte> deflated;
  if (deflate) deflated = deflate_bytes(bytes);
  const std::span<const std::byte> data = deflate ? std::span<const std::byte>(deflated) : bytes;
  state_->add_member(
      {name, deflate ? ZipMethod::kDeflated : ZipMethod::kStored, crc32(bytes), data.size(), bytes.size(), 0}, data);
}

void ArchiveWriter::add_deflated_member(const std::string& name, std::span<const std::byte> deflated,
                                        std::uint64_t bytes, std::uint32_t crc32_of_bytes) {
  state_->add_member({name, ZipMethod::kDeflated, crc32_of_bytes, deflated.size(), bytes, 0}, deflated);
}

void ArchiveWriter::copy_tile(const CopySource& from, PlaneTile tile, const TableRecord& record, const Digest& digest) {
  State& state = *state_;
  const TileEntry& entry = record.entry;
  ISOHF_ASSERT(tile.plane != 0 || state.grid.flat_index(tile.tile) == state.contents.next_tile());
  const ZipMember member{tile_name(tile.tile, tile.plane), ZipMethod::kDeflated, entry.payload_crc32,
                         entry.compressed_bytes,           entry.payload_bytes,  state.position()};
  TableRecord copied = record;
  copied.entry.offset_bytes = member.header_offset + local_header_bytes(member);
  state.copy(from, entry.offset_bytes, member);
  state.contents.add_copy(tile, member, copied, digest);
}

void ArchiveWriter::copy_member(const CopySource& from, const TablePlace& place, const TableRecord& record) {
  State& state = *state_;
  const TileEntry& entry = record.entry;
  const ZipMember member{member_name(place.table, place.row, place.column),
                         record.deflated ? ZipMethod::kDeflated : ZipMethod::kStored,
                         entry.payload_crc32,
                         entry.compressed_bytes,
                         entry.payload_bytes,
                         state.position()};
  state.copy(from, entry.offset_bytes, member);
  state.contents.add_copy(place, member);
}

void ArchiveWriter::stop_copies() noexcept {
  if (state_ == nullptr) return;
  state_->collected = {};
  {
    const std::lock_guard lock(state_->mutex);
    state_->ahead.clear();
  }
  try {
    state_->copying.wait();
  } catch (...) {  // another failure is on its way
  }
}

void ArchiveWriter::end_copies() {
  state_->end_copies();
}

void ArchiveWriter::flush_tiles() {
  state_->end_copies();
  state_->named([&] { state_->part.flush(); });
}

TileEntry ArchiveWriter::tile_entry(TileIndex tile, int plane) const {
  return state_->contents.tile_entry(tile, plane);
}

TileCodes ArchiveWriter::read_tile(TileIndex tile, const Quantisation& quantisation, int plane) const {
  const State& state = *state_;
  const TileEntry entry = state.contents.tile_entry(tile, plane);
  if (!entry.stored) return void_tile(state.grid.shape(), quantisation);
  std::vector<std::byte> deflated(entry.compressed_bytes);
  std::vector<std::byte> payload(entry.payload_bytes);
  if (state.part.read_at(entry.offset_bytes, deflated) != deflated.size()) {
    throw Error(ErrorCode::kIo, fmt::format("{}: tile ({},{}) at byte {} cannot be read back", state.part.path(),
                                            tile.column, tile.row, entry.offset_bytes));
  }
  inflate_exactly(deflated, payload);
  return decode_tile(state.grid.shape(), quantisation.type, payload);
}

const std::string& ArchiveWriter::part() const {
  return state_->part.part_path();
}

const std::string& ArchiveWriter::content_hash(const Metadata& metadata) {
  State& state = *state_;
  ISOHF_ASSERT(state.contents.next_tile() == state.grid.tile_count());
  if (state.content_hash.empty()) state.content_hash = state.contents.finish_hash(metadata);
  return state.content_hash;
}

/// What callers say of source and conversion goes into metadata that no reader may refuse.
void require_readable(const std::string& json) {
  try {
    if (json.size() > kMaxMetadataBytes) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("metadata: {} bytes, at most {} can be read", json.size(), kMaxMetadataBytes));
    }
    (void)accuracy_info(parse_metadata(json));
  } catch (const Error& error) {
    throw Error(ErrorCode::kInvalidArgument,
                std::string("what is asked for makes an archive that cannot be read: ") + error.what());
  }
}

void ArchiveWriter::complete(Metadata metadata) {
  State& state = *state_;
  ISOHF_ASSERT(!state.finished);
  (void)content_hash(metadata);
  state.end_copies();
  state.named([&] {
    state.part.flush();
    if (state.members_end != 0) state.part.truncate(state.members_end);
  });
  state.members_end = state.part.position();
  metadata.planes = state.options.planes;
  metadata.tiles_stored = state.contents.tiles_stored();
  if (static_cast<std::uint64_t>(state.grid.tile_count()) >
          most_tiles(static_cast<std::uint64_t>(metadata.tiles_stored)) &&
      !shard_record(metadata)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: {}x{} tiles, of which {} have an elevation, make an archive that cannot be read; "
                            "convert the part of the source that has elevations",
                            state.path, state.grid.tile_columns(), state.grid.tile_rows(), metadata.tiles_stored));
  }
  metadata.content_sha256 = state.content_hash;
  metadata.ground_sha256 = ground_hash(metadata);
  std::erase_if(metadata.extensions, [](const auto& extension) { return extension.first == kDataCrcName; });
  metadata.extensions.emplace_back(kDataCrcName, fmt::format("\"{:08x}\"", state.contents.data_crc32()));
  const std::string json = format_metadata(metadata) + "\n";
  require_readable(json);
  const auto data = std::as_bytes(std::span<const char>(json));
  state.named([&] {
    const ZipMember index = state.contents.append_index(state.part);
    const ZipMember member{kMetadataName, ZipMethod::kStored, crc32(data),
                           data.size(),   data.size(),        state.part.position()};
    state.append(member, data);
    state.contents.append_directory(index, member, state.part);
    state.part.flush();
  });
}

std::uint64_t ArchiveWriter::finish(Metadata metadata) {
  State& state = *state_;
  complete(std::move(metadata));
  const std::uint64_t size = state.part.position();
  state.named([&] { state.part.commit(); });
  state.finished = true;
  remove_file(state.journal_path);
  remove_part_aside(state.part.part_path());
  return size;
}

bool ArchiveWriter::keep_part() noexcept {
  State& state = *state_;
  if (state.finished || !state.journal) return false;
  // Where the disk is full, what reached it counts; a resume checks it.
  const auto attempt = [](const auto& save) {
    try {
      save();
    } catch (const std::exception&) {
    }
  };
  attempt([&] { state.part.sync(); });
  attempt([&] { state.journal->flush(); });
  if (!state.journal->has_flushed_records()) {
    // The journal is worth more than the last tiles: a resume writes these again.
    constexpr std::uint64_t kBlocks = std::uint64_t{64} << 10U;
    const std::uint64_t room = state.journal->pending_bytes() + kBlocks;
    attempt([&] {
      if (state.part.size_on_disk() <= room) return;
      state.part.truncate(state.part.size_on_disk() - room);
      state.journal->flush();
    });
  }
  if (!state.journal->has_flushed_records()) return false;
  state.keep = true;
  state.part.keep();
  return true;
}

}  // namespace isohf
