#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/tile_range.h"
#include "isohf/verify.h"
#include "verify/tile_probe.h"

namespace isohf::view {

/// The worst place of one kind of finding in one tile at one level.
struct ViewFinding {
  int id;  ///< isohf::finding
  TileIndex tile;
  int level = 0;
  std::string where;       ///< place, what was found, what was required
  double deviation = 0.0;  ///< codes, normal components, parts of the sun, or pixels not drawn once
  std::int64_t count = 1;  ///< places at fault
};

struct ViewChecks {
  bool shadows = true;
  /// Only these tiles, and the rows of their shadows.
  std::optional<TileRange> tiles;
  /// Called now and then with what is looked at, how much of it has been, and all of it.
  std::function<void(const char*, std::int64_t, std::int64_t)> progress;
};

struct ViewReport {
  std::int64_t tiles = 0;
  std::int64_t pictures = 0;  ///< draws read back and compared
  std::int64_t pixels = 0;    ///< compared with the library
  std::int64_t vertices = 0;
  std::int64_t shared_vertices = 0;  ///< compared between tiles
  std::int64_t shadow_vertices = 0;
  std::int64_t seeded_vertices = 0;  ///< of them, drawn from shadow seeds
  std::vector<double> suns_deg;      ///< that shadows were looked at for, from either side
  double worst_shadow = 0.0;         ///< part of the sun that is hidden
  /// A sun whose shadows were compared with rays from a sample of the vertices. Lit is a share of 1/2 or more.
  struct RaySun {
    double azimuth_deg = 0.0;
    double elevation_deg = 0.0;
    std::int64_t vertices = 0;
    std::int64_t dark = 0;             ///< by rays
    std::int64_t lit_though_dark = 0;  ///< drawn lit, dark by rays
    std::int64_t dark_though_lit = 0;
  };
  std::vector<RaySun> ray_suns;
  double worst_height = 0.0;  ///< codes, within tolerance or not
  double worst_normal = 0.0;
  std::int64_t failures = 0;          ///< findings in all
  std::vector<ViewFinding> findings;  ///< at most kMaxFindings, the first ones

  static constexpr std::size_t kMaxFindings = 50;
  [[nodiscard]] bool passed() const { return failures == 0; }
  void add(ViewFinding finding) {
    ++failures;
    if (findings.size() < kMaxFindings) findings.push_back(std::move(finding));
  }
};

/// "shared vertices", ...: what a check looks at, by the id of its findings.
[[nodiscard]] std::string check_name(int id);

/// Draws every tile at every level through the buffers, shaders and index arrays that pictures are drawn with, and
/// compares what comes back with the library's own arithmetic. A GL context must be current.
///
/// arrays  what SharedGeometry uploads; make_index_arrays(shape) unless a fault is wanted
/// The oracles never look at the arrays: level λ is the barycentric surface of a coarse tile. A tile that cannot be
/// read is a finding; Errors of GL are thrown.
[[nodiscard]] ViewReport verify_view(const TileSource& source, const IndexArrays& arrays,
                                     const ViewChecks& options = {});

// Inside of it, from here on.

/// What every check works with.
struct CheckContext {
  const TileSource& source;
  const SharedGeometry& shared;
  MeshOracle& oracle;
  TileProbe& probe;
  const ViewChecks& options;
  ViewReport& report;
};

/// Reads the index arrays back from the GPU and checks each level's mesh, strip and stitch together: every side that is
/// not on the tile's border must belong to two triangles that run along it in opposite directions, and what is left
/// over must be the full-detail border, counter-clockwise, each side once. With that no crack can open between tiles
/// whose border vertices are drawn in the same places, and no triangle faces down. Findings name tile (0, 0): all tiles
/// share the arrays.
void verify_mesh(const SharedGeometry& shared, ViewReport& report);

/// The checks that need one tile at a time, and those between a tile and the ones before it.
void verify_tiles(const CheckContext& context);

/// Checks the shadows that pictures are drawn with: for some suns in the East and West, light is swept over each whole
/// row of tiles (paper section 3.13), and compared with what the shaders make of each tile's own: from the archive's
/// seeds if it has them. If the source has an archive, also compares shadows of two suns that stand elsewhere with rays
/// from a sample of the vertices.
void verify_shadows(const CheckContext& context);

// Why tolerances are what they are: codes and unit normals pass through 32-bit interpolation, whose planes are told
// from the picture's corner: an error of about spread·2^-21 for each pixel of distance, where spread is the difference
// that a triangle spans. The fixed part is the float rounding of 65535.
inline constexpr double kCodeTolerance = 0.05;
inline constexpr double kPerPixel = 1.0 / (1 << 21);

/// Keeps the worst of many deviations and how many there were.
class Worst {
 public:
  template <typename Describe>
  void add(double deviation, Describe&& describe) {
    ++count_;
    if (!(deviation > worst_) && count_ > 1) return;
    worst_ = deviation;
    where_ = describe();
  }
  [[nodiscard]] bool any() const { return count_ > 0; }
  /// Reports the worst, if there was any.
  void report(ViewReport& report, int id, TileIndex tile, int level) const {
    if (any()) report.add({id, tile, level, where_, worst_, count_});
  }

 private:
  double worst_ = -1.0;
  std::int64_t count_ = 0;
  std::string where_;
};

/// "vertex (c 3, r 4)"
[[nodiscard]] std::string vertex_name(GridVertex vertex);

/// "object space (12.25, 3.50), triangle (c .., r ..) .." of pixel (i, j) of a window.
[[nodiscard]] std::string pixel_name(const TileShape& shape, const PixelWindow& window, int i, int j,
                                     const PixelSample& sample);

/// Heights in codes as the library takes them: NaN where void.
[[nodiscard]] std::vector<float> heights_from(std::span<const std::uint16_t> codes, double code_height = 1.0);

}  // namespace isohf::view
