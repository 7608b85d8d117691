// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// What the archive's index says of one tile.
struct TileEntry {
  bool stored = false;             ///< false: wholly void, takes no bytes
  std::uint64_t offset_bytes = 0;  ///< of the compressed data in the file
  std::uint32_t compressed_bytes = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t payload_crc32 = 0;
  std::uint32_t code_min = 0;  ///< as in EncodedTile
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

/// Decodes the tiles of an archive in any order, from any number of threads at once. Nothing in the file is trusted.
class ArchiveReader {
 public:
  /// Opens a file. Opening reads its tail, the index and the metadata, no tile; what is read later is read from the
  /// file: nothing grows with it. Throws Error{kIo} where the file cannot be opened, Error{kCorrupt} or
  /// Error{kUnsupported} naming member and byte offset where it is no archive that this build can read.
  explicit ArchiveReader(const std::string& path);

  /// The same from anything that reads a range of bytes; `name` is what messages call it. Opening reads both ends, two
  /// ranges; of an archive of more than some 600 tiles also index and directory, in pieces of 1 MiB. The index is kept,
  /// 32 bytes a tile, so that a tile then costs one range.
  ArchiveReader(std::shared_ptr<const ByteSource> source, const std::string& name);
  ~ArchiveReader();
  ArchiveReader(const ArchiveReader&) = delete;
  ArchiveReader& operator=(const ArchiveReader&) = delete;

  [[nodiscard]] const std::string& path() const;  ///< or name
  [[nodiscard]] const ByteSource& source() const;
  [[nodiscard]] std::uint64_t size_bytes() const;
  [[nodiscard]] const Metadata& metadata() const;
  [[nodiscard]] const TileGrid& grid() const { return metadata().grid; }
  [[nodiscard]] const std::string& metadata_json() const;  ///< as stored, for --json
  /// Has metadata().source.map be what the source's reference system was understood as.
  void set_source_map(std::shared_ptr<const ReferenceMap> map);

  /// True where the index disagreed with the ZIP directory and tiles are found by the directory instead.
  [[nodiscard]] bool reads_by_directory() const;
  /// What opening found odd, one line each, for the user.
  [[nodiscard]] const std::vector<Warning>& warnings() const;

  /// Holds the whole ZIP structure against the profile of docs/archive_format.md: every directory entry, local header
  /// and name, order, gaps and overlaps, index against directory. One line for each thing wrong; empty where all is
  /// well.
  [[nodiscard]] std::vector<std::string> check_structure() const;

  [[nodiscard]] TileEntry tile_entry(TileIndex tile) const;
  [[nodiscard]] const std::vector<MemberEntry>& members() const;  ///< all but the tiles, in file order

  /// True where zlib inflates the tile's member to the same payload; tiles that are not stored need nothing inflated.
  /// Throws Error{kCorrupt} like read_tile.
  [[nodiscard]] bool zlib_reads(TileIndex tile) const;
  /// The same for any other member, whose bytes are known already; stored ones need nothing inflated.
  [[nodiscard]] bool zlib_reads(const MemberEntry& member, std::span<const std::byte> bytes) const;

  /// Decodes one tile; a tile that is not stored comes back wholly void. Throws Error{kCorrupt} naming tile and byte.
  [[nodiscard]] TileCodes read_tile(TileIndex tile) const;

  /// Several at once, which takes less time than one after the other. Throws for the first that cannot be read.
  [[nodiscard]] std::vector<TileCodes> read_tiles(std::span<const TileIndex> tiles) const;

  /// The same as elevations in vertical units, NaN where void. C*R doubles.
  [[nodiscard]] std::vector<double> read_elevations(TileIndex tile) const;

  /// Inflates any other member; nullopt where there is none of that name.
  [[nodiscard]] std::optional<std::vector<std::byte>> read_member(const std::string& name) const;
  /// The same for one of members(), without a search.
  [[nodiscard]] std::vector<std::byte> read_member(const MemberEntry& member) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace isohf
