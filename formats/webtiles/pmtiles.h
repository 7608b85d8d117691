#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "isohf/base/file.h"
#include "isohf/error.h"

namespace isohf {

/// Where a tile is: columns from the 180th meridian, rows from the North, of 2^zoom each.
struct TilePlace {
  int zoom = 0;
  std::int64_t column = 0;
  std::int64_t row = 0;
};

/// The tiles of a zoom level that are there.
struct TileBox {
  std::int64_t first_column = 0;
  std::int64_t last_column = 0;
  std::int64_t first_row = 0;
  std::int64_t last_row = 0;
  TilePlace any;  ///< one of them

  void include(std::int64_t column, std::int64_t row, std::int64_t side);
};

/// A PMTiles archive (version 3, directories plain or in gzip): the tiles of a web map in one file.
class PmtilesFile {
 public:
  explicit PmtilesFile(const std::string& path);

  /// The levels with tiles, as the file states them.
  [[nodiscard]] int coarsest() const { return coarsest_; }
  [[nodiscard]] int finest() const { return finest_; }
  /// nullopt: the level has no tiles.
  [[nodiscard]] std::optional<TileBox> box(int zoom);
  /// The tile as it is stored, a picture; false if there is none. For any number of threads.
  [[nodiscard]] bool read(const TilePlace& place, std::vector<std::byte>& stored);
  /// How elevations are packed, as the file states it (TileJSON's "encoding"); empty: it does not.
  [[nodiscard]] std::string encoding() const;

 private:
  /// Tiles of one picture from `number` on, or with `run` 0 the directory of all from it on.
  struct Entry {
    std::uint64_t number = 0;
    std::uint64_t offset = 0;
    std::uint32_t bytes = 0;
    std::uint32_t run = 0;
  };
  using Directory = std::vector<Entry>;

  [[noreturn]] void fail(ErrorCode code, const std::string& what) const;
  [[nodiscard]] std::uint64_t sum(std::uint64_t a, std::uint64_t b) const;
  [[nodiscard]] std::vector<std::byte> bytes_at(std::uint64_t offset, std::uint64_t bytes, bool is_gzip) const;
  [[nodiscard]] Directory read_directory(std::uint64_t offset, std::uint64_t bytes) const;
  [[nodiscard]] const Directory& leaf(const Entry& entry, std::uint64_t end);
  void add_all(const Directory& directory, int zoom, int depth, std::optional<TileBox>& box);

  File file_;
  int coarsest_ = 0;
  int finest_ = 0;
  bool has_packed_directories_ = false;
  bool has_packed_tiles_ = false;
  std::uint64_t metadata_offset_ = 0;
  std::uint64_t metadata_bytes_ = 0;
  std::uint64_t leaves_offset_ = 0;
  std::uint64_t tiles_offset_ = 0;
  Directory root_;
  std::mutex one_looks_;
  std::map<std::uint64_t, Directory> leaves_;  ///< by their offsets
  std::size_t kept_entries_ = 0;
};

/// Whether a file begins as PMTiles does.
[[nodiscard]] bool looks_like_pmtiles(std::span<const std::byte> head);

}  // namespace isohf
