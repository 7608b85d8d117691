#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "isohf/surface/shade/normals.h"
#include "paging/tile_source.h"
#include "verify/tile_probe.h"
#include "verify/verify_report.h"

namespace isohf::view {

/// The checks that need one tile at a time, and those between a tile and the ones before it in flat order.
class TileVerifier {
 public:
  TileVerifier(const TileSource& source, const SharedGeometry& shared, MeshOracle& oracle, TileProbe& probe,
               const VerifyOptions& options, VerifyReport& report);

  /// Tiles in flat-index order.
  void verify(TileIndex tile);

 private:
  /// What some tile said of a vertex that others store too.
  struct SharedVertex {
    std::uint16_t code = 0;
    bool has_normal = false;
    float nx = 0.0F, ny = 0.0F, nz = 0.0F;
    TileIndex tile{};
  };

  void check_vertices(TileIndex tile);
  void check_shared(TileIndex tile);
  void check_level(TileIndex tile, bool voids, int level, const PixelWindow& window);
  void check_transition(TileIndex tile, bool voids, double level, const PixelWindow& window);
  void diagnose_coverage(bool voids, int level, const PixelWindow& window, const Finding& finding);
  void compute_normals();

  const TileSource& source_;
  const VerifyOptions& options_;
  VerifyReport& report_;
  MeshOracle& oracle_;
  TileProbe& probe_;
  TileSlot slot_;
  std::vector<std::uint16_t> codes_;
  std::vector<Normal> normals_;
  std::vector<ProbedVertex> captured_;
  std::vector<float> pixels_;
  std::unordered_map<std::uint64_t, SharedVertex> seen_;  ///< of the last two tile rows' rims
  std::int64_t seen_row_ = 0;
};

}  // namespace isohf::view
