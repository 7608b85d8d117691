#include "isohf/archive/journal.h"

#include <algorithm>
#include <filesystem>
#include <optional>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::uint64_t kJournalMagic = 0x324c4e4a46485349;  // "ISHFJNL2"
constexpr std::size_t kHeaderBytes = 8 + 32 + 4;

std::vector<std::byte> make_header(const Digest& job) {
  std::vector<std::byte> bytes;
  bytes.reserve(kHeaderBytes);
  ByteWriter writer(bytes);
  writer.write(kJournalMagic);
  writer.write_bytes(job);
  writer.write(crc32(bytes));
  return bytes;
}

void append_record(const JournalRecord& record, std::vector<std::byte>& out) {
  const std::size_t start = out.size();
  ByteWriter writer(out);
  writer.write(static_cast<std::uint32_t>(record.kind));
  writer.write(static_cast<std::uint32_t>(record.member.name.size()));
  writer.write(static_cast<std::uint32_t>(record.member.method));
  writer.write(record.member.crc32);
  writer.write(record.member.compressed_bytes);
  writer.write(record.member.bytes);
  writer.write(record.member.header_offset);
  writer.write(record.data_crc32);
  writer.write(record.code_min);
  writer.write(record.code_max);
  writer.write(static_cast<std::uint32_t>(record.has_voids ? 1 : 0));
  writer.write_bytes(record.digest);
  const TileStatistics& statistics = record.statistics;
  for (const std::int64_t count : {statistics.vertices, statistics.voids, statistics.clamped}) writer.write(count);
  for (const double value : {statistics.sum, statistics.min, statistics.max, statistics.worst_rounding}) {
    writer.write(value);
  }
  writer.write_bytes(std::as_bytes(std::span<const char>(record.member.name)));
  writer.write(crc32(std::span<const std::byte>(out).subspan(start)));
}

/// Throws Error{kCorrupt} at the journal's end, however it looks.
JournalRecord read_record(std::span<const std::byte> bytes, std::size_t& position) {
  ByteReader reader(bytes.subspan(position));
  JournalRecord record;
  const auto kind = reader.read<std::uint32_t>();
  record.kind = static_cast<JournalRecord::Kind>(kind);
  const auto name_bytes = reader.read<std::uint32_t>();
  record.member.method = static_cast<ZipMethod>(reader.read<std::uint32_t>());
  record.member.crc32 = reader.read<std::uint32_t>();
  record.member.compressed_bytes = reader.read<std::uint64_t>();
  record.member.bytes = reader.read<std::uint64_t>();
  record.member.header_offset = reader.read<std::uint64_t>();
  record.data_crc32 = reader.read<std::uint32_t>();
  record.code_min = reader.read<std::uint32_t>();
  record.code_max = reader.read<std::uint32_t>();
  record.has_voids = reader.read<std::uint32_t>() != 0;
  const auto digest = reader.read_bytes(record.digest.size());
  std::copy(digest.begin(), digest.end(), record.digest.begin());
  TileStatistics& statistics = record.statistics;
  for (auto* count : {&statistics.vertices, &statistics.voids, &statistics.clamped})
    *count = reader.read<std::int64_t>();
  for (double* value : {&statistics.sum, &statistics.min, &statistics.max, &statistics.worst_rounding}) {
    *value = reader.read<double>();
  }
  const auto name = reader.read_bytes(name_bytes);
  record.member.name.assign(reinterpret_cast<const char*>(name.data()), name.size());
  const std::uint32_t found = crc32(bytes.subspan(position, reader.position()));
  if (kind < 1 || kind > 4 || reader.read<std::uint32_t>() != found) throw Error(ErrorCode::kCorrupt, "journal record");
  position += reader.position();
  return record;
}

std::string journal_of(const std::string& part) {
  return part + ".journal";
}

std::string aside_of(const std::string& part) {
  return part + ".old";
}

/// 0 where there is no such file.
std::uint64_t bytes_of(const std::string& path) {
  std::error_code none;
  const std::uintmax_t bytes =
      std::filesystem::is_regular_file(path, none) ? std::filesystem::file_size(path, none) : 0;
  return none ? 0 : bytes;
}

/// Of one that has a journal with records.
std::uint64_t resumable_bytes(const std::string& part) {
  return bytes_of(journal_of(part)) > kHeaderBytes ? bytes_of(part) : 0;
}

/// A file that is there, locked; nullopt where another process writes it, or it cannot be opened.
std::optional<File> locked(const std::string& path) {
  try {
    File file(path, File::Mode::kReadWrite);
    if (file.try_lock() && file.is_at_path()) return file;
  } catch (const Error&) {  // whoever opens it next says why
  }
  return std::nullopt;
}

/// The journal first: with it alone aside, the part finds it again.
void move_part(const std::string& from, const std::string& to) {
  static_cast<void>(rename_file(journal_of(from), journal_of(to), true));
  static_cast<void>(rename_file(from, to, true));
}

/// After a run that was killed between the two steps of move_part().
void find_journal_again(const std::string& part) {
  const std::string aside = aside_of(part);
  for (const auto& [lost, found] : {std::pair(part, aside), {aside, part}}) {
    const bool is_lost = bytes_of(lost) > 0 && bytes_of(journal_of(lost)) == 0;
    if (is_lost && bytes_of(found) == 0 && bytes_of(journal_of(found)) > 0)
      static_cast<void>(rename_file(journal_of(found), journal_of(lost), true));
  }
}

}  // namespace

std::uint64_t interrupted_bytes(const std::string& part) {
  const std::uint64_t bytes = resumable_bytes(part);
  if (bytes > 0 && !locked(part)) return 0;
  return std::max(bytes, resumable_bytes(aside_of(part)));
}

void put_part_aside(const std::string& part) {
  if (bytes_of(part) == 0) return;
  const auto lock = locked(part);
  if (!lock) return;
  find_journal_again(part);
  const std::string aside = aside_of(part);
  if (resumable_bytes(part) <= resumable_bytes(aside)) return;
  remove_part_aside(part);
  move_part(part, aside);
}

void take_part_back(const std::string& part, const Digest& job) {
  const std::string aside = aside_of(part);
  if (bytes_of(part) == 0 && bytes_of(aside) == 0) return;
  const auto lock = bytes_of(part) > 0 ? locked(part) : std::nullopt;
  if (bytes_of(part) > 0 && !lock) return;
  find_journal_again(part);
  if (resumable_bytes(aside) <= resumable_bytes(part)) return;
  std::vector<std::byte> header(kHeaderBytes);
  if (File(journal_of(aside), File::Mode::kRead).read_at(0, header) != kHeaderBytes || header != make_header(job))
    return;
  remove_file(journal_of(part));
  move_part(aside, part);
}

void remove_part_aside(const std::string& part) noexcept {
  remove_file(aside_of(part));
  remove_file(journal_of(aside_of(part)));
}

Journal Journal::start(const std::string& path, const Digest& job) {
  Journal journal(File(path, File::Mode::kReadWrite));
  journal.file_.truncate(0);
  journal.pending_ = make_header(job);
  journal.flush();
  return journal;
}

Journal::Opened Journal::open(const std::string& path, const Digest& job) {
  Opened opened{Journal(File(path, File::Mode::kReadWrite)), true, {}, {}, kHeaderBytes};
  std::vector<std::byte> bytes(opened.journal.file_.size_bytes());
  bytes.resize(opened.journal.file_.read_at(0, bytes));
  const std::vector<std::byte> header = make_header(job);
  const bool has_header = bytes.size() >= kHeaderBytes && std::equal(header.begin(), header.begin() + 8, bytes.begin());
  if (!has_header) {
    opened.journal = start(path, job);
    return opened;
  }
  opened.matches = std::equal(header.begin(), header.end(), bytes.begin());
  if (!opened.matches) return opened;
  try {
    for (std::size_t position = kHeaderBytes; position < bytes.size();) {
      opened.records.push_back(read_record(bytes, position));
      opened.ends.push_back(position);
    }
  } catch (const Error&) {
    // A run that was killed leaves its last record cut off: the journal ends before it.
  }
  return opened;
}

void Journal::add(const JournalRecord& record) {
  append_record(record, pending_);
}

void Journal::flush() {
  file_.write_at(size_, pending_);
  size_ += pending_.size();
  pending_.clear();
}

bool Journal::has_flushed_records() const {
  return size_ > kHeaderBytes;
}

void Journal::truncate(std::uint64_t size_bytes) {
  file_.truncate(size_bytes);
  size_ = size_bytes;
}

}  // namespace isohf
