#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "isohf/restore/surface_rows.h"

namespace isohf {

/// The surface of an archive at places in any order, on the triangles.
///
/// Decodes each tile that a call meets once, whatever the order; tiles of the last call are kept, up to kKeptBytes of
/// them. Works on the caller's oneTBB arena; the bits depend on tiles and places alone.
class ScatteredSurface {
 public:
  static constexpr std::uint64_t kKeptBytes = std::uint64_t{32} << 20U;

  ScatteredSurface(const TileGrid& grid, const Quantisation& quantisation, SurfaceRows::ReadTile read_tile);

  /// elevations [n] out, vertical units, of places [n]; NaN where the surface has a void or ends, and for a place that
  /// is NaN. Quick where neighbours in `places` are neighbours on the ground.
  void read(std::span<const WorldPoint> places, std::span<double> elevations);

 private:
  using Heights = std::shared_ptr<const std::vector<double>>;

  [[nodiscard]] Heights decode(std::int64_t tile) const;

  TileGrid grid_;
  Quantisation quantisation_;
  SurfaceRows::ReadTile read_tile_;
  std::map<std::int64_t, Heights> kept_;  ///< by flat index
};

}  // namespace isohf
