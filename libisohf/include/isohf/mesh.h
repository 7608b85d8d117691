// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "isohf/job.h"
#include "isohf/lattice.h"
#include "isohf/tile_range.h"

/// Tiles as triangles: index arrays, vertex positions and normals (paper sections 3.2 to 3.5 and 3.11). The shapes of
/// the arrays are in docs/archive_format.md, section 4.2; docs/engine.md draws a tile in an engine.

namespace isohf {

class ArchiveReader;
struct Metadata;

/// The four sides of a tile.
enum class TileSide { kWest, kEast, kNorth, kSouth };

/// Whether a list of triangles has those that join a tile to neighbours at other levels.
enum class Stitches { kIncluded, kLeftOut };

/// The index arrays that all tiles of one shape share. An index is column + row * C of a stored vertex. All triangles
/// wind counter-clockwise seen from above.
///
/// To draw a tile at level λ: strip(λ) as a triangle strip, then stitch(λ) as a triangle list. Neighbouring tiles of one
/// plane meet without a crack at any two levels. Where a tile meets a tile of the next coarser plane, draw
/// side_stitch() of that side as well. Immutable; any number of threads may use one object.
class TileMesh {
 public:
  /// overview_stride  Metadata::planes.stride if tiles of different planes are drawn beside each other; 0 if not.
  /// Throws Error{kInvalidArgument} unless the stride is 0 or a power of two >= 2 that divides C-4 and (R-3)/2.
  explicit TileMesh(const TileShape& shape, int overview_stride = 0);

  [[nodiscard]] const TileShape& shape() const { return shape_; }
  /// Levels that can be drawn: those of the shape, and with overviews at least log2(stride) + 1.
  [[nodiscard]] int levels() const { return static_cast<int>(strips_.size()); }

  /// All arrays one after the other, for one index buffer. The spans below are parts of it.
  [[nodiscard]] std::span<const std::uint32_t> indices() const { return indices_; }
  /// The body of a tile, 0 <= level < levels(). Includes triangles that repeat a vertex and have no area.
  [[nodiscard]] std::span<const std::uint32_t> strip(int level) const { return part(strips_, level); }
  /// Triangles that join the strip to the border of full detail, three indices each; empty at level 0.
  [[nodiscard]] std::span<const std::uint32_t> stitch(int level) const { return part(stitches_, level); }
  /// Triangles that join the border of full detail to a tile of the next coarser plane; empty without overviews.
  [[nodiscard]] std::span<const std::uint32_t> side_stitch(TileSide side) const {
    return part(sides_, static_cast<int>(side));
  }

  /// What strip() and stitch() draw as a triangle list, without the triangles that repeat a vertex.
  /// elevations  [C x R], leaves out triangles with a NaN at a vertex; empty: keeps all
  /// Throws Error{kInvalidArgument} if the number of elevations is neither 0 nor C*R.
  [[nodiscard]] std::vector<std::uint32_t> triangles(int level, std::span<const double> elevations = {},
                                                     Stitches stitches = Stitches::kIncluded) const;

 private:
  struct Part {
    std::size_t first = 0;
    std::size_t count = 0;
  };
  [[nodiscard]] std::span<const std::uint32_t> part(const std::vector<Part>& parts, int at) const;

  TileShape shape_;
  std::vector<std::uint32_t> indices_;
  std::vector<Part> strips_;
  std::vector<Part> stitches_;
  std::vector<Part> sides_;  ///< by TileSide
};

/// Object-space x and z of the C*R stored vertices in storage order: the one vertex buffer that all tiles of a shape
/// share (Eq. 1, section 3.2). x counts half column steps from the West edge, z rows from the North edge.
[[nodiscard]] std::vector<std::array<std::int16_t, 2>> object_positions(const TileShape& shape);

/// A vertex as graphics interfaces take it: x East, y up, z South.
struct MeshVertex {
  std::array<float, 3> position;  ///< world units
  std::array<float, 3> normal;    ///< unit length
};

struct VertexOptions {
  WorldPoint origin{0.0, 0.0};   ///< where position (0, elevation, 0) is. Near the tile, floats keep their precision
  double elevation_scale = 1.0;  ///< world units in one vertical unit, exaggeration included
};

/// Positions and normals of the C*R stored vertices of a tile, in storage order. Tiles that share a vertex compute the
/// same bits for it. Vertices of an overview's tile beyond the heightfield are moved to its edge.
/// elevations  [C x R], vertical units, as ArchiveReader::read_elevations(tile, plane) returns them
/// plane       0: the tiles themselves; 1 to metadata.planes.count: an overview
/// At nodata y is NaN and the normal (0, 1, 0); beside nodata the normal is (0, 1, 0) as well. Vertices that are not
/// visible have the normal (0, 0, 0).
/// Throws Error{kInvalidArgument} for a tile or plane that does not exist, or if there are not C*R elevations.
[[nodiscard]] std::vector<MeshVertex> tile_vertices(const Metadata& metadata, TileIndex tile,
                                                    std::span<const double> elevations,
                                                    const VertexOptions& options = {}, int plane = 0);

/// What texture coordinates count over, from (0, 0) in the North-West to (1, 1): each tile, or all of the mesh.
enum class TextureSpan { kTile, kMesh };

/// Which triangles of an archive to take. At most one of level, max_triangles and max_error may be set; none: level 0.
struct MeshRequest {
  std::optional<TileRange> tiles = {};             ///< of plane 0, not empty; nullopt: all
  std::optional<int> level = {};                   ///< one level for all, through all planes: 0 is full detail
  std::optional<std::int64_t> max_triangles = {};  ///< the finest level that has no more
  std::optional<double> max_error = {};  ///< vertical units, >= 0: for each tile the coarsest level of plane 0 that
                                         ///< lies no further from level 0, at each of its vertices
  double elevation_scale = 1.0;          ///< world units in one vertical unit, exaggeration included
};

/// What a request amounts to.
struct MeshPlan {
  int plane = 0;
  TileRange tiles;                        ///< of that plane
  int level = 0;                          ///< of the plane's tiles, if `levels` is empty
  std::vector<std::uint8_t> levels = {};  ///< of each tile of `tiles`, row by row; then stitches are drawn as well
  std::int64_t triangles = 0;             ///< at most: those at nodata are left out later
  WorldPoint corner;                      ///< world position of the North-West corner of `tiles`
  WorldPoint size{};                      ///< width and height, as far as the heightfield reaches
  double elevation_scale = 1.0;
  TextureSpan texture_span = TextureSpan::kMesh;  ///< a caller may change it

  [[nodiscard]] int level_of(TileIndex tile) const;
};

/// Decides plane and levels. With max_error all tiles are decoded once, stage "levels". Memory: a byte a tile.
/// Throws Error{kInvalidArgument} for a request that makes no sense, or if even the coarsest level has too many
/// triangles; what reading tiles throws; Error{kCancelled}.
[[nodiscard]] MeshPlan plan_mesh(const ArchiveReader& archive, const MeshRequest& request, const Job& job = {});

/// The triangles of one tile. Only vertices that a triangle uses are there.
struct MeshPiece {
  TileIndex tile{};
  WorldPoint corner{};                               ///< of the tile, relative to MeshPlan::corner; z South
  std::vector<MeshVertex> vertices;                  ///< positions relative to the tile's corner
  std::vector<std::array<float, 2>> texture_places;  ///< of each vertex, over plan.texture_span
  std::vector<std::uint32_t> indices;                ///< three for each triangle
};

/// Hands the pieces of a mesh to `take`, row by row of tiles, tiles without a triangle left out. Works on the caller's
/// oneTBB arena; `take` is called by one thread at a time. Vertices that tiles share are the same bits in both, but for
/// the rounding of floats relative to another corner. Memory: some tiles for each thread. Stage "mesh".
void read_mesh(const ArchiveReader& archive, const MeshPlan& plan, const std::function<void(const MeshPiece&)>& take,
               const Job& job = {});

}  // namespace isohf
