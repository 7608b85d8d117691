#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/projection/other_reading.h"

namespace isohf {

/// Coordinates of the places of an archive's world. NaN if a place has none.
struct Coordinates {
  std::function<MapPoint(WorldPoint)> from_world;
  std::function<WorldPoint(MapPoint)> to_world;
};

/// "world", "lonlat" (longitude first), "crs" (of the archive's source) or the text of a reference system, as
/// understand_grid_system() takes it. Has the source's map understood if that is needed. Throws Error, naming the
/// archive, if it has no such coordinates.
[[nodiscard]] Coordinates coordinates_in(const std::string& system, ArchiveReader& archive,
                                         std::vector<Warning>& warnings);

/// What numbers may have been meant as that name no place of an archive: swapped, longitude and latitude, UTM.
/// first  how they were read, in coordinates of the source; nullopt: as these
[[nodiscard]] std::optional<OtherReading> other_reading_of(ArchiveReader& archive, const MapBounds& asked,
                                                           const std::optional<PairReading>& first = {});

}  // namespace isohf
