#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "isohf/archive.h"
#include "isohf/base/handed_in.h"
#include "isohf/mesh.h"

namespace isohf {
namespace {

constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();

/// Makes pieces of tiles. Any thread.
class PieceMaker {
 public:
  PieceMaker(const ArchiveReader& archive, const MeshPlan& plan)
      : archive_(archive),
        plan_(plan),
        grid_(archive.metadata().plane_grid(plan.plane)),
        mesh_(grid_.shape(), archive.metadata().planes.count > 0 ? archive.metadata().planes.stride : 0) {}

  [[nodiscard]] MeshPiece make(TileIndex tile) const {
    MeshPiece piece;
    piece.tile = tile;
    if (!archive_.tile_entry(tile, plan_.plane).stored) return piece;
    const WorldPoint corner = grid_.world_from_object(tile, {0.0, 0.0});
    piece.corner = {corner.x - plan_.corner.x, corner.z - plan_.corner.z};
    const std::vector<double> elevations = archive_.read_elevations(tile, plan_.plane);
    // Tiles of one level meet as they are.
    piece.indices = mesh_.triangles(plan_.level_of(tile), elevations,
                                    plan_.levels.empty() ? Stitches::kLeftOut : Stitches::kIncluded);
    const auto vertices =
        tile_vertices(archive_.metadata(), tile, elevations, {corner, plan_.elevation_scale}, plan_.plane);
    if (plan_.plane > 0) drop_flat(vertices, piece.indices);
    keep_used(vertices, piece);
    return piece;
  }

 private:
  /// Triangles of an overview beyond the heightfield, whose vertices are moved to its edge, have no area.
  static void drop_flat(const std::vector<MeshVertex>& vertices, std::vector<std::uint32_t>& indices) {
    std::vector<std::uint32_t> kept;
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      const auto& a = vertices[indices[i]].position;
      const auto& b = vertices[indices[i + 1]].position;
      const auto& c = vertices[indices[i + 2]].position;
      const bool is_flat = (b[0] - a[0]) * (c[2] - a[2]) == (b[2] - a[2]) * (c[0] - a[0]);
      if (!is_flat) kept.insert(kept.end(), {indices[i], indices[i + 1], indices[i + 2]});
    }
    indices = std::move(kept);
  }

  [[nodiscard]] std::array<float, 2> texture_place(WorldPoint corner, const std::array<float, 3>& position) const {
    const bool by_tile = plan_.texture_span == TextureSpan::kTile;
    const double x = position[0] + (by_tile ? 0.0 : corner.x);
    const double z = position[2] + (by_tile ? 0.0 : corner.z);
    return {static_cast<float>(x / (by_tile ? grid_.extent_x() : plan_.size.x)),
            static_cast<float>(z / (by_tile ? grid_.extent_z() : plan_.size.z))};
  }

  void keep_used(const std::vector<MeshVertex>& vertices, MeshPiece& piece) const {
    std::vector<std::uint32_t> numbers(vertices.size(), kUnused);
    for (std::uint32_t& index : piece.indices) {
      std::uint32_t& number = numbers[index];
      if (number == kUnused) {
        number = static_cast<std::uint32_t>(piece.vertices.size());
        piece.vertices.push_back(vertices[index]);
        piece.texture_places.push_back(texture_place(piece.corner, vertices[index].position));
      }
      index = number;
    }
  }

  const ArchiveReader& archive_;
  const MeshPlan& plan_;
  TileGrid grid_;
  TileMesh mesh_;
};

}  // namespace

void read_mesh(const ArchiveReader& archive, const MeshPlan& plan, const std::function<void(const MeshPiece&)>& take,
               const Job& job) {
  require_callback(take);
  const PieceMaker maker(archive, plan);
  const std::int64_t columns = plan.tiles.end.column - plan.tiles.first.column;
  constexpr std::int64_t kBatch = 16;
  std::vector<MeshPiece> pieces;
  for (std::int64_t first = 0; first < plan.tiles.count(); first += kBatch) {
    job.throw_if_cancelled();
    const std::int64_t end = std::min(first + kBatch, plan.tiles.count());
    pieces.assign(static_cast<std::size_t>(end - first), {});
    oneapi::tbb::parallel_for(first, end, [&](std::int64_t i) {
      pieces[static_cast<std::size_t>(i - first)] =
          maker.make({plan.tiles.first.column + i % columns, plan.tiles.first.row + i / columns});
    });
    for (const MeshPiece& piece : pieces) {
      if (!piece.indices.empty()) take(piece);
    }
    job.report({"mesh", "tiles", end, plan.tiles.count()});
  }
}

}  // namespace isohf
