// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "isohf/byte_source.h"
#include "isohf/error.h"
#include "isohf/metadata.h"

namespace isohf {

/// The C*R elevations of one tile, row by row, as stored: 16-bit codes (kU16 and kU8) or floats (kF32). Exactly one of
/// the two vectors is in use.
struct TileCodes {
  CodeType type = CodeType::kU16;
  std::vector<std::uint16_t> codes;  ///< kU16, kU8; void as in Quantisation::void_code()
  std::vector<float> heights;        ///< kF32; void is NaN

  friend bool operator==(const TileCodes&, const TileCodes&) = default;
};

/// What the archive's index says of one tile. Of a coarse plane's tile the range is that of all that lies below it.
struct TileEntry {
  bool stored = false;             ///< false: wholly void, takes no bytes
  std::uint64_t offset_bytes = 0;  ///< of the compressed data in the file
  std::uint32_t compressed_bytes = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t payload_crc32 = 0;
  std::uint32_t code_min = 0;  ///< smallest and largest code that is not void; bits of floats for kF32
  std::uint32_t code_max = 0;
  bool has_voids = false;
};

/// Any other member.
struct MemberEntry {
  std::string name;
  std::uint64_t offset_bytes = 0;
  std::uint64_t compressed_bytes = 0;
  std::uint64_t bytes = 0;
  std::uint32_t crc32 = 0;
  bool deflated = false;
};

/// What the index says of all members of one kind: the tiles, those of a coarse plane, seeds, textures of one size, ...
struct MemberTable {
  std::string name;          ///< of its members: "tiles/{row}/{column}.tile", "residual/{row:8}"
  std::int64_t columns = 0;  ///< the grid that they stand in
  std::int64_t rows = 0;
  std::int64_t stored = 0;             ///< members that are there
  std::uint64_t compressed_bytes = 0;  ///< of these
  std::uint32_t code_min = 0;          ///< over all tiles that are stored, as in TileEntry; 0 for other members
  std::uint32_t code_max = 0;
  bool has_voids = false;  ///< in one that is stored
};

/// Decodes the tiles of an archive in any order, from any number of threads at once. Nothing in the file is trusted.
class ArchiveReader {
 public:
  /// Whether a shard is read, which is no archive before it was merged with the others.
  enum class Shards { kRefused, kRead };

  /// Opens a file. Opening reads its tail and the metadata, no tile and no index but where its pages are; what is read
  /// later is read from the file: nothing grows with it. Throws Error{kIo} where the file cannot be opened, Error{kCorrupt} or
  /// Error{kUnsupported} naming member and byte offset where it is no archive that this build can read, and
  /// Error{kInvalidArgument} for a shard that is refused.
  explicit ArchiveReader(const std::string& path, Shards shards = Shards::kRefused);

  /// The same from anything that reads a range of bytes; `name` is what messages call it. Opening reads the last 256
  /// KiB, and as much again where a longer directory stands there; pages of the index are read when they are asked for,
  /// and some MiB of them kept, so that a tile mostly costs one range.
  ArchiveReader(std::shared_ptr<const ByteSource> source, const std::string& name, Shards shards = Shards::kRefused);
  ~ArchiveReader();
  ArchiveReader(ArchiveReader&&) noexcept;
  ArchiveReader(const ArchiveReader&) = delete;
  ArchiveReader& operator=(const ArchiveReader&) = delete;

  [[nodiscard]] const std::string& path() const;  ///< or name
  [[nodiscard]] const ByteSource& source() const;
  [[nodiscard]] std::uint64_t size_bytes() const;
  [[nodiscard]] const Metadata& metadata() const;
  [[nodiscard]] const TileGrid& grid() const { return metadata().grid; }
  [[nodiscard]] const std::string& metadata_json() const;  ///< as stored, for --json
  /// Has metadata().source.map be what the source's reference system was understood as. Before other threads read.
  void set_source_map(std::shared_ptr<const ReferenceMap> map);
  /// The same of metadata().projection->spec.map, if the archive is on a reference system. Before other threads read.
  void set_world_map(std::shared_ptr<const ReferenceMap> map);

  /// True where the index disagreed with the ZIP directory and tiles are found by the directory instead.
  [[nodiscard]] bool reads_by_directory() const;
  /// What opening found odd, one line each, for the user.
  [[nodiscard]] const std::vector<Warning>& warnings() const;

  /// Compares the whole file with the profile of docs/archive_format.md: every directory entry, local header and name,
  /// order, gaps and overlaps, index and directory, the data of each member that is not a tile. One line for each thing
  /// wrong; empty if all is well.
  [[nodiscard]] std::vector<std::string> check_structure() const;

  /// `plane` 0 are the tiles themselves; 1 to metadata().planes.count are the coarse planes, each with its grid,
  /// metadata().plane_grid(plane). What is no tile of the plane's grid throws Error{kInvalidArgument}.
  [[nodiscard]] TileEntry tile_entry(TileIndex tile, int plane = 0) const;
  /// SHA-256 of the tile's elevations as the archive states it, without decoding any (docs/archive_format.md, "Content
  /// hash"); nullopt where the archive is read by the directory.
  [[nodiscard]] std::optional<std::array<std::byte, 32>> tile_digest(TileIndex tile, int plane = 0) const;

  /// What there is of each kind of members, the tiles first, without a look at any of them.
  [[nodiscard]] const std::vector<MemberTable>& tables() const;
  /// Members in none of tables(), in file order: the metadata, the index, and what other tools added.
  [[nodiscard]] const std::vector<MemberEntry>& loose_members() const;
  /// All but the tiles, in file order: goes through the whole directory and, once read, keeps it.
  [[nodiscard]] const std::vector<MemberEntry>& members() const;
  /// A member that is no tile by its name, in a table or loose; nullopt where there is none.
  [[nodiscard]] std::optional<MemberEntry> find_member(const std::string& name) const;

  /// Decodes one tile; a tile that is not stored comes back wholly void. Throws Error{kCorrupt} naming tile and byte.
  [[nodiscard]] TileCodes read_tile(TileIndex tile, int plane = 0) const;

  /// The same as elevations in vertical units, NaN where void. C*R doubles.
  [[nodiscard]] std::vector<double> read_elevations(TileIndex tile, int plane = 0) const;

  /// Inflates any other member; nullopt where there is none of that name.
  [[nodiscard]] std::optional<std::vector<std::byte>> read_member(const std::string& name) const;
  /// The same for one that is known already, without a search.
  [[nodiscard]] std::vector<std::byte> read_member(const MemberEntry& member) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace isohf
