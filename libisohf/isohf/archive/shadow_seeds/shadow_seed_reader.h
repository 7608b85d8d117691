#pragma once

#include <cstdint>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"

namespace isohf {

/// Reads an archive's shadow seeds: the exact shadow height at any tile's edge, touching no other tile.
/// Thread-safe. The archive must outlive it.
class ShadowSeedReader {
 public:
  /// Throws Error{kInvalidArgument} where the archive has no seeds; kCorrupt, kUnsupported.
  explicit ShadowSeedReader(const ArchiveReader& archive);

  [[nodiscard]] const ShadowSeedInfo& info() const { return info_; }

  /// The casters of a tile, none where it has no member. `tile` is the tile as read_tile gives it. Throws
  /// Error{kCorrupt}.
  [[nodiscard]] HullSeeds hulls(TileIndex index, const TileCodes& tile) const;

 private:
  [[nodiscard]] std::vector<std::byte> payload(TileIndex index) const;

  const ArchiveReader& archive_;
  ShadowSeedInfo info_;
};

}  // namespace isohf
