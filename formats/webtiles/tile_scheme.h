#pragma once

#include <filesystem>

namespace isohf {

/// How the tiles ZOOM/COLUMN/ROW of a folder are numbered.
enum class TileScheme {
  kFromNorth,  ///< "xyz": rows of the Web Mercator map from the North
  kFromSouth,  ///< "tms": from the South
  kOtherMap,   ///< squares of another map
};

/// What the folder's tilemapresource.xml (OSGeo's Tile Map Service), metadata.json, tiles.json, tile.json or
/// tilejson.json states; kFromNorth if none of them
/// does. Throws Error{kCorrupt} naming two that contradict each other, or
/// one that cannot be read.
[[nodiscard]] TileScheme tile_scheme_of(const std::filesystem::path& folder);

}  // namespace isohf
