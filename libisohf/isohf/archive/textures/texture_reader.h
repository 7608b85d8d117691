#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/textures/texture_info.h"
#include "isohf/picture.h"

namespace isohf {

/// Reads an archive's textures, any level of any tile, from any number of threads at once. The archive must outlive it.
class TextureReader {
 public:
  /// Throws Error{kInvalidArgument} where the archive has no textures; kCorrupt, kUnsupported.
  explicit TextureReader(const ArchiveReader& archive);

  [[nodiscard]] const TextureInfo& info() const { return info_; }

  /// True where the tile has a texture.
  [[nodiscard]] bool has(TileIndex tile) const { return has(tile, info_.levels - 1); }
  [[nodiscard]] bool has(TileIndex tile, int level) const;

  /// Level `level` of a tile, info().level_size(level) texels on a side, info().channels channels as stored.
  /// Throws Error{kInvalidArgument} where has() is false; kCorrupt naming the member.
  [[nodiscard]] Picture read(TileIndex tile, int level) const;
  /// The same as RGBA, opaque where the archive stores no alpha.
  [[nodiscard]] Picture read_rgba(TileIndex tile, int level) const;

 private:
  [[nodiscard]] std::optional<MemberEntry> member(TileIndex tile, int level) const;

  const ArchiveReader& archive_;
  TextureInfo info_;
};

}  // namespace isohf
