#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/base/file.h"
#include "isohf/base/zip.h"

namespace isohf {

/// One step of writing an archive, as its journal keeps it for a resume.
struct JournalRecord {
  enum class Kind : std::uint32_t { kTile = 1, kEmptyTile = 2, kMember = 3, kPlaneTile = 4 };
  Kind kind = Kind::kTile;
  ZipMember member;              ///< what was written; unused for an empty tile
  std::uint32_t data_crc32 = 0;  ///< of the member's data as they stand in the file
  std::uint32_t code_min = 0;
  std::uint32_t code_max = 0;
  bool has_voids = false;
  Digest digest{};            ///< of a tile's content, on a coarse plane too
  TileStatistics statistics;  ///< of a tile
};

/// NAME.part.journal: a header that names the job, then a record for every step, each with a CRC of its own. What is
/// cut off or damaged ends the journal.
class Journal {
 public:
  /// Starts an empty journal, dropping what the file holds.
  static Journal start(const std::string& path, const Digest& job);

  /// Opens an existing one and reads its intact records. `matches` is false, and nothing is read, where it belongs to
  /// another job; a file without a valid header has no records and matches.
  struct Opened;
  static Opened open(const std::string& path, const Digest& job);

  /// Remembers a step; it reaches the file with the next flush().
  void add(const JournalRecord& record);
  void flush();
  [[nodiscard]] std::size_t pending_bytes() const { return pending_.size(); }  ///< that flush() would write
  /// Whether a later open() finds anything.
  [[nodiscard]] bool has_flushed_records() const;
  /// Forgets everything behind the first `records` that open() returned. `sizes` as open() returned them.
  void truncate(std::uint64_t size_bytes);

 private:
  explicit Journal(File file) : file_(std::move(file)) {}

  File file_;
  std::uint64_t size_ = 0;
  std::vector<std::byte> pending_;
};

struct Journal::Opened {
  Journal journal;
  bool matches = true;
  std::vector<JournalRecord> records;
  std::vector<std::uint64_t> ends;  ///< byte offset behind each record
  std::uint64_t header_bytes = 0;
};

// What an interrupted run left: NAME.part and its journal. A run that starts over keeps both as NAME.part.old and
// NAME.part.old.journal until it is complete. `part` is NAME.part.

/// Bytes of what was left that a resume may continue, the larger of the two; 0 where there is nothing, or another process
/// writes it.
[[nodiscard]] std::uint64_t interrupted_bytes(const std::string& part);
/// Before a run that starts over. If something was put aside already, the larger of the two is kept.
void put_part_aside(const std::string& part);
/// Before a run that resumes: what was put aside becomes NAME.part if it is of this job and the larger of the two.
void take_part_back(const std::string& part, const Digest& job);
/// Once the archive is complete.
void remove_part_aside(const std::string& part) noexcept;

}  // namespace isohf
