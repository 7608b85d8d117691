#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace isohf {

/// Where a tile is: columns from the 180th meridian, rows from the North, of 2^zoom each.
struct TilePlace {
  int zoom = 0;
  std::int64_t column = 0;
  std::int64_t row = 0;
};

/// The tiles of a web map in one file.
class TileStore {
 public:
  /// The tiles of a zoom level that are there.
  struct Box {
    std::int64_t first_column = 0;
    std::int64_t last_column = 0;
    std::int64_t first_row = 0;
    std::int64_t last_row = 0;
    TilePlace any;  ///< one of them
  };

  TileStore() = default;
  TileStore(const TileStore&) = delete;
  TileStore& operator=(const TileStore&) = delete;
  virtual ~TileStore() = default;

  /// The coarsest and finest level with tiles. Throws Error{kCorrupt} where there is none.
  [[nodiscard]] virtual std::pair<int, int> zooms() = 0;
  /// nullopt: the level has no tiles.
  [[nodiscard]] virtual std::optional<Box> box(int zoom) = 0;
  /// The tile as it is stored, a picture; false where there is none. For any number of threads.
  [[nodiscard]] virtual bool read(const TilePlace& place, std::vector<std::byte>& stored) = 0;
  /// What the file says of how elevations are packed; empty: nothing.
  [[nodiscard]] virtual std::string encoding() = 0;
};

/// A PMTiles archive (version 3).
[[nodiscard]] std::unique_ptr<TileStore> open_pmtiles_store(const std::string& path);

/// "mapbox" of {"encoding": "mapbox"}, as TileJSON has it; empty for any other text.
[[nodiscard]] std::string encoding_in_json(const std::string& text);

}  // namespace isohf
