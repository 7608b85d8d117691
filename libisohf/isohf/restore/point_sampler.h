#pragma once

#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "isohf/lattice/barycentric.h"
#include "isohf/restore/ground_scale.h"
#include "isohf/restore/predict/fixed_point.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/surface.h"

namespace isohf {

/// The elevation of a tile's surface at a point of it, on the triangle there; NaN where a vertex of weight is void.
[[nodiscard]] double elevation_at(const TileShape& shape, const TileCodes& codes, const Quantisation& quantisation,
                                  const Barycentric& where);

/// Decodes a tile, void ones too; called from many threads at once.
using ReadTile = std::function<TileCodes(TileIndex)>;
[[nodiscard]] ReadTile tiles_of(const ArchiveReader& archive, int plane = 0);

/// Decodes neighbouring tiles on all threads of the caller's oneTBB arena, and hands each to use(how far from the first,
/// codes) on the thread that decoded it.
void for_each_tile(const ReadTile& read_tile, TileIndex first, std::int64_t tiles,
                   const std::function<void(std::int64_t, const TileCodes&)>& use);

/// What Surface does, for tiles that come from anywhere.
///
/// The points of a call are sorted by tile, runs on one tile together: each tile is decoded once.
class PointSampler {
 public:
  /// Keeps at most `memory_bytes` of decoded tiles, and has as much again in hand during a call; one tile in each
  /// thread at least. Normals are those of heights and lengths in metres, by `scale`.
  /// world  where the surface ends; nullopt: with the grid, beyond which a coarse plane may reach
  PointSampler(const TileGrid& grid, const Quantisation& quantisation, ReadTile read_tile, std::uint64_t memory_bytes,
               const GroundScale& scale = {}, const std::optional<TileGrid>& world = {});

  void sample(std::span<const WorldPoint> points, std::span<SurfaceSample> samples);
  void sample(std::span<const WorldPoint> points, std::span<double> elevations);
  /// In integers, on the triangles.
  void sample(std::span<const FixedPlace> places, const FixedHeights& heights, std::span<double> elevations);

  using Codes = std::shared_ptr<const TileCodes>;
  /// One tile, decoded now or kept; from many threads at once.
  [[nodiscard]] Codes codes(TileIndex tile);

 private:
  struct Kept {
    std::int64_t tile;
    Codes codes;
  };

  [[nodiscard]] std::int64_t tile_under(WorldPoint point) const;
  template <typename TileOf, typename Sample>
  void visit(std::size_t points, const TileOf& tile_of, const Sample& sample);
  [[nodiscard]] Codes kept(std::int64_t tile);
  void keep(std::int64_t tile, const Codes& codes);

  TileGrid grid_;
  TileGrid grid_m_;  ///< whose lengths are metres
  double metres_;    ///< in one elevation unit
  WorldPoint end_;
  Quantisation quantisation_;
  ReadTile read_tile_;
  std::size_t capacity_;  ///< tiles to keep
  std::mutex mutex_;      ///< of what follows
  std::list<Kept> used_;  ///< last used first
  std::unordered_map<std::int64_t, std::list<Kept>::iterator> by_tile_;
};

}  // namespace isohf
