#include "verify/verify_view.h"

#include "verify/verify_mesh.h"
#include "verify/verify_seams.h"
#include "verify/verify_shadows.h"
#include "verify/verify_tiles.h"

namespace isohf::view {

std::string to_string(Check check) {
  switch (check) {
    case Check::kReadable:
      return "readable";
    case Check::kShared:
      return "shared vertices";
    case Check::kVertex:
      return "vertices";
    case Check::kCoverage:
      return "coverage";
    case Check::kWinding:
      return "winding";
    case Check::kHeight:
      return "heights";
    case Check::kNormal:
      return "normals";
    case Check::kTransition:
      return "transitions";
    case Check::kCrack:
      return "cracks";
    case Check::kMesh:
      return "mesh";
    case Check::kShadow:
      return "shadows";
    case Check::kSunShare:
      return "share of the sun";
  }
  return "unknown";
}

VerifyReport verify_view(const TileSource& source, const IndexArrays& arrays, const VerifyOptions& options) {
  VerifyReport report;
  const TileGrid& grid = source.grid();
  const SharedGeometry shared(grid.shape(), arrays);
  verify_mesh(shared, report);
  {
    MeshOracle oracle(grid.shape());
    TileProbe probe(grid, shared, source.scale().scale);
    TileVerifier tiles(source, shared, oracle, probe, options, report);
    for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
      tiles.verify(grid.tile_at(flat));
      if (options.progress) options.progress(flat + 1, grid.tile_count());
    }
    if (options.shadows && source.shadow_seeds() != nullptr) {
      ShadowVerifier(source, shared, oracle, probe, options, report).verify();
    }
  }
  if (options.seams) SeamVerifier(source, shared, report).verify();
  return report;
}

}  // namespace isohf::view
