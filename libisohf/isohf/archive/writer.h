#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/container/member_tables.h"
#include "isohf/archive/tile/tile_codes.h"
#include "isohf/byte_source.h"
#include "isohf/metadata.h"

namespace isohf {

/// What a writer may do to files that exist.
struct WriterOptions {
  bool overwrite = false;  ///< replace a finished archive of the final name
  bool resume = false;     ///< continue NAME.part where its journal says so, after checking what is there
  /// Identifies the job for resuming: the same text means the same input and options. Stored in the journal.
  std::string job_fingerprint;
  PlaneInfo planes;             ///< coarse planes that add_plane_tile fills, up to as many
  std::int64_t first_tile = 0;  ///< flat index of the first that is added; those before are not there
  bool journal = true;          ///< keep one for a resume; without it a part file is never kept
};

/// Where members are copied from. What is being copied keeps it.
struct CopySource {
  std::shared_ptr<const ByteSource> bytes;
  std::string name;  ///< in errors
};

/// Whether a file begins as an archive of any version of the format. No other file is ever replaced by one, but an empty
/// one.
[[nodiscard]] bool is_archive_file(const std::string& path);

/// Writes an archive from its first byte to its last: tiles in flat-index order, members, then finish().
///
/// Everything goes to NAME.part (and its journal NAME.part.journal), which finish() flushes to the disk and renames;
/// nothing ever stands half-written under the final name. Destroyed unfinished, the writer removes its part file,
/// unless keep_part() was called. Not thread-safe. Every call throws Error{kIo} with path and reason (disk full, ...).
/// Two processes cannot write the same archive at once: the second gets Error{kIo}. Memory does not
/// grow with the tiles but by a tenth of a byte for each.
class ArchiveWriter {
 public:
  /// Opens NAME.part beside `path`, or beside what it links to. Throws Error{kInvalidArgument} where `path` exists
  /// without overwrite, or is no archive, or what OutputFile refuses; Error{kIo} where the folder is missing or not
  /// writable.
  ArchiveWriter(const std::string& path, const TileGrid& grid, const WriterOptions& options);
  ~ArchiveWriter();
  ArchiveWriter(const ArchiveWriter&) = delete;
  ArchiveWriter& operator=(const ArchiveWriter&) = delete;

  /// Flat index of the next tile that add_tile expects: 0, or where a resumed job goes on.
  [[nodiscard]] std::int64_t next_tile() const;

  /// Tiles so far that hold an elevation, bytes so far, and the sum of all tiles' statistics, added in flat order:
  /// those that a resumed job found in the journal count like those that it adds.
  [[nodiscard]] std::int64_t tiles_stored() const;
  [[nodiscard]] std::uint64_t bytes_written() const;
  [[nodiscard]] std::uint64_t tile_bytes() const;  ///< of the tiles' members alone, compressed
  [[nodiscard]] TileStatistics statistics() const;
  /// Sums of elevations by row of tiles, from the first on, as far as tiles were added.
  [[nodiscard]] const std::vector<double>& row_sums() const;

  /// How many members other than tiles there are so far under a folder ("seeds/"), and their compressed bytes.
  [[nodiscard]] MemberTotals members_in(const std::string& folder) const;

  /// Appends the tile with flat index next_tile(). An empty tile takes no bytes.
  void add_tile(const EncodedTile& tile);

  /// Goes on behind so many tiles that are not there. A resume does not know of it.
  void skip_tiles(std::int64_t tiles);

  /// Appends a tile of a coarse plane, 1 to WriterOptions::planes.count; those of one plane by ascending flat index. An
  /// empty one takes no bytes. Like members between two tiles it belongs to the tile of plane 0 that follows.
  ///   below  smallest and largest code of all that the tile stands for
  void add_plane_tile(int plane, TileIndex tile, const EncodedTile& encoded,
                      std::pair<std::uint32_t, std::uint32_t> below);

  /// Appends any other member. `name` is relative, '/'-separated, without "..", not in tiles/ or planes/. Stored or deflated as
  /// `deflate` says. Members added between two tiles belong to the tile that follows: a resumed job adds them again
  /// where that tile had not been written.
  void add_member(const std::string& name, std::span<const std::byte> bytes, bool deflate);
  /// The same for one that is deflated already: `bytes` and `crc32_of_bytes` are those of the inflated member.
  void add_deflated_member(const std::string& name, std::span<const std::byte> deflated, std::uint64_t bytes,
                           std::uint32_t crc32_of_bytes);

  /// Appends a member of another archive at its place in a table as it stands there, local header included, which must
  /// say what the record says: Error{kCorrupt} from here or a later call. What follows one another there is copied in
  /// large pieces, beside the caller's thread, on its oneTBB arena.
  /// Without a journal only. A tile of a plane, which adds nothing to statistics():
  void copy_tile(const CopySource& from, PlaneTile tile, const TableRecord& record, const Digest& digest);
  void copy_member(const CopySource& from, const TablePlace& place, const TableRecord& record);
  /// Waits for what is being copied, and forgets the rest: before the arena is left. Any other call copies all.
  void stop_copies() noexcept;
  void end_copies();

  /// Makes every tile added so far readable by read_tile.
  void flush_tiles();
  /// What is known of a tile that was added, or of a coarse plane's.
  [[nodiscard]] TileEntry tile_entry(TileIndex tile, int plane = 0) const;
  /// Decodes a tile that was added before flush_tiles(), for members that are made from the tiles as stored; also those
  /// that a resumed job found. Any number of threads at once, but none beside the other functions.
  [[nodiscard]] TileCodes read_tile(TileIndex tile, const Quantisation& quantisation, int plane = 0) const;

  /// Once all tiles are there: the hash that the metadata will state, by their grid and quantisation.
  [[nodiscard]] const std::string& content_hash(const Metadata& metadata);

  /// Makes the part file a whole archive with these metadata, which may be read as part() until the next call: so
  /// that finish() can say in the metadata what was found by reading it. Then only complete() and finish() may follow.
  void complete(Metadata metadata);
  [[nodiscard]] const std::string& part() const;

  /// Completes the archive: index, metadata (planes, tiles_stored and the hashes are filled in here), directory; flush
  /// and rename. All tiles must have been added. Returns the archive's size in bytes. Throws Error{kIo} where somebody else made `path` meanwhile (then
  /// the finished part file stays).
  std::uint64_t finish(Metadata metadata);

  /// Leaves NAME.part and its journal in place for a later resume, where they hold anything; false where not. After it
  /// nothing is added.
  bool keep_part() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace isohf
