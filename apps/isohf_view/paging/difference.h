#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "isohf/archive.h"
#include "isohf/surface.h"

namespace isohf::view {

/// Another reader of the same bytes, whatever its file's name has become: one whose reference systems are understood as far
/// as can be, which may load PROJ. `archive`, which several threads may be reading, outlives it.
[[nodiscard]] ArchiveReader understood(const ArchiveReader& archive);
/// Where an archive's world lies; nullopt where that is not known.
[[nodiscard]] std::optional<WorldGeoreference> understood_places(const ArchiveReader& archive);

/// Places of one archive's world in another's: by the coordinates that both have, else by longitude and latitude; the same
/// numbers where neither says where it lies.
class WorldJoin {
 public:
  /// Throws Error{kInvalidArgument} where only one says where it lies.
  WorldJoin(const ArchiveReader& from, const ArchiveReader& to);
  /// NaN where the other's map has no such place.
  [[nodiscard]] WorldPoint operator()(WorldPoint at) const;

 private:
  std::optional<WorldGeoreference> from_;
  std::optional<WorldGeoreference> to_;
  bool by_source_ = false;
};

/// How far the surface of a second archive lies above that of a first, in elevation units of the first. Any lattices. Any
/// number of threads.
class SurfaceDifference {
 public:
  /// Opens the second. Throws as ArchiveReader and WorldJoin do, and where the two have no ground in common.
  SurfaceDifference(const ArchiveReader& first, const std::string& second);

  /// at [n]  places of the first's world; elevations [n]  of the first there, and the differences out, NaN where the second
  /// has no elevation.
  void take_from(std::span<const WorldPoint> at, std::span<double> elevations) const;
  /// Most differences lie within this, up or down: 1, 2 or 5 times a power of ten.
  [[nodiscard]] double range() const { return range_; }

 private:
  WorldJoin join_;
  ArchiveReader second_;
  double unit_;  ///< elevation units of the first in one of the second's
  double range_ = 1.0;
  mutable std::mutex one_;
  mutable Surface surface_;
};

}  // namespace isohf::view
