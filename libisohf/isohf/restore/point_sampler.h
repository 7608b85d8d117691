#pragma once

#include <array>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <span>
#include <unordered_map>

#include "isohf/archive.h"

namespace isohf {

/// What the surface has at a place.
struct SurfaceSample {
  enum class State : std::uint8_t { kSurface, kVoid, kOutside };
  State state = State::kOutside;
  TileIndex tile{-1, -1};                          ///< where the place lies; (-1, -1) outside
  double elevation = 0.0;                          ///< of the triangle there, as it is drawn; kSurface alone
  std::array<double, 3> normal = {0.0, 1.0, 0.0};  ///< vertex normals' blend over it, of length 1; likewise
};

/// The surface of an archive at any number of places in any order.
///
/// The places of a call are sorted by tile: each tile that it meets is decoded once, several at a time on all threads
/// of the caller's oneTBB arena. The codes of tiles used last are kept. What is found depends on neither.
class PointSampler {
 public:
  /// Keeps at most `memory_bytes` of decoded tiles. The archive outlives it.
  PointSampler(const ArchiveReader& archive, std::uint64_t memory_bytes);

  /// samples [n] out, of places [n]; a place that is NaN lies outside. Throws as ArchiveReader::read_tiles does. One
  /// call at a time.
  void sample(std::span<const WorldPoint> places, std::span<SurfaceSample> samples);

 private:
  using Codes = std::shared_ptr<const TileCodes>;
  struct Kept {
    std::int64_t tile;
    Codes codes;
  };

  [[nodiscard]] Codes kept(std::int64_t tile);
  void keep(std::int64_t tile, const Codes& codes);

  const ArchiveReader& archive_;
  std::size_t capacity_;        ///< tiles to keep
  std::size_t tiles_together_;  ///< decoded at once by one thread
  std::mutex mutex_;            ///< of what follows
  std::list<Kept> used_;        ///< last used first
  std::unordered_map<std::int64_t, std::list<Kept>::iterator> by_tile_;
};

}  // namespace isohf
