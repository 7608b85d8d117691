#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "isohf/metadata.h"
#include "isohf/picture.h"

/// Textures as members of an archive (docs/archive_format.md, "Textures").

namespace isohf {

/// The metadata's member "tile_textures".
struct TextureInfo {
  TextureFormat format = TextureFormat::kJpeg;
  int channels = 3;  ///< 1 grey, 3 RGB, 4 RGBA
  int size = 0;      ///< texels on a side of the finest level, a power of two
  int levels = 0;    ///< level l has size >> l texels on a side
  int quality = 0;   ///< kJpeg: 1...100
  std::string photo_name;
  std::string photo_format;
  std::int64_t photo_width = 0;
  std::int64_t photo_height = 0;
  std::string placed_by;  ///< "georeference" or "source"
  WorldBounds placement;  ///< the photo's outer pixel edges; around what it shows of the source, where projected
  std::int64_t members = 0;
  std::uint64_t bytes = 0;  ///< of all members

  [[nodiscard]] int level_size(int level) const { return size >> level; }
};

inline constexpr const char* kTileTexturesName = "tile_textures";  ///< of the metadata's extension
inline constexpr const char* kTextureFolder = "textures/";

class JsonMembers;
void texture_members(JsonMembers& json, TextureInfo& info);

/// The extension's JSON.
[[nodiscard]] std::string format_texture_info(const TextureInfo& info);
/// The record of an archive's metadata; nullopt where it has no textures. Throws Error{kCorrupt} naming the member at
/// fault, kUnsupported for other formats.
[[nodiscard]] std::optional<TextureInfo> texture_info(const Metadata& metadata);
/// What the metadata's `textures` holds: the pattern of names.
[[nodiscard]] std::string texture_name_pattern(TextureFormat format);

/// "textures/ROW/COLUMN/SIZE.jpg".
[[nodiscard]] std::string texture_name(const TextureInfo& info, TileIndex tile, int level);
struct TexturePlace {
  TileIndex tile;
  int level;
};
/// Tile and level of such a name; nullopt where it is none in exactly that form.
[[nodiscard]] std::optional<TexturePlace> place_from_texture_name(const TextureInfo& info, std::string_view name);

}  // namespace isohf
