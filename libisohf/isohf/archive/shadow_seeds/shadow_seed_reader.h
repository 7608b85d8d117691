#pragma once

#include <cstdint>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/shadow_seeds/shadow_seeds.h"

namespace isohf {

/// Reads an archive's shadow seeds: the exact shadow height at any tile's edge, touching no other tile.
/// Thread-safe. Memory: 8 bytes a tile. The archive must outlive it.
class ShadowSeedReader {
 public:
  /// Finds the members. Throws Error{kInvalidArgument} where the archive has no seeds; kCorrupt, kUnsupported.
  explicit ShadowSeedReader(const ArchiveReader& archive);

  [[nodiscard]] const ShadowSeedInfo& info() const { return info_; }

  /// True where the seeds hold for that sun elevation.
  [[nodiscard]] bool covers(double sun_elevation_deg) const;

  /// Shadow height at the edge where light enters, for stored rows 1 to R-2, in elevation units; minus infinity where
  /// nothing casts a shadow that is higher than the tile's own vertex there. This is what tile_shadow takes as
  /// `entering`. `tile` is the tile as read_tile gives it. Throws Error{kInvalidArgument} where covers() is false,
  /// kCorrupt.
  [[nodiscard]] std::vector<double> entering(TileIndex index, const TileCodes& tile, LightTravel travel,
                                             double sun_elevation_deg) const;

  /// The hulls themselves, none where the tile has no member.
  [[nodiscard]] HullSeeds hulls(TileIndex index, const TileCodes& tile) const;

 private:
  [[nodiscard]] std::vector<std::byte> payload(TileIndex index) const;

  const ArchiveReader& archive_;
  ShadowSeedInfo info_;
};

}  // namespace isohf
