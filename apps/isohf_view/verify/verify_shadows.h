#pragma once

#include <vector>

#include "paging/tile_source.h"
#include "verify/tile_probe.h"
#include "verify/verify_report.h"

namespace isohf::view {

/// Checks the shadows that pictures are drawn with: for some sun elevations and both directions of light, shadow
/// heights are carried by the library from tile to tile along each row of tiles, without seeds, and compared with what
/// the shaders make of those that each tile gets from its own seeds.
class ShadowVerifier {
 public:
  ShadowVerifier(const TileSource& source, const SharedGeometry& shared, MeshOracle& oracle, TileProbe& probe,
                 const VerifyOptions& options, VerifyReport& report);

  void verify();

 private:
  void verify_row(std::int64_t row, LightTravel travel);
  void verify_tile(TileIndex tile, const RowSun& sun, std::size_t sun_number, std::vector<double>& entering);
  void check_vertices(TileIndex tile, const RowSun& sun);
  void check_share(TileIndex tile, const RowSun& sun, int level, const PixelWindow& window);
  [[nodiscard]] bool voids(TileIndex tile) const;

  const TileSource& source_;
  MeshOracle& oracle_;
  TileProbe& probe_;
  const VerifyOptions& options_;
  VerifyReport& report_;
  TileSlot slot_;
  double tolerance_;  ///< codes
  std::vector<std::uint16_t> codes_;
  std::vector<float> heights_;         ///< the same, NaN where void
  std::vector<float> carried_;         ///< shadow heights by the library
  std::vector<std::uint16_t> seeded_;  ///< by the tile's own seeds
  std::vector<ProbedVertex> captured_;
  std::vector<float> pixels_;
};

}  // namespace isohf::view
