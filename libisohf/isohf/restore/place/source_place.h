#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/metadata.h"
#include "isohf/projection/reference_map.h"
#include "isohf/raster.h"

namespace isohf {

/// Where a source lies: the outer edges of what its samples stand for, in its own coordinates and in degrees.
struct SourcePlace {
  MapBounds bounds;
  std::optional<MapGround> ground;  ///< nullopt if it is not known
  bool has_map_scale = false;       ///< of ground: the source lies on a map
  std::string why_no_ground;        ///< in one line; empty if no reference system is named
};

/// nullopt if the place has no origin. PROJ is loaded only for maps whose ground is not `stored`.
[[nodiscard]] std::optional<SourcePlace> source_place(const Georeference& place, std::int64_t width,
                                                      std::int64_t height, Registration registration,
                                                      const std::optional<MapGround>& stored = std::nullopt);
/// Of an archive's source; of an extract what of it lies there.
[[nodiscard]] std::optional<SourcePlace> source_place(const Metadata& metadata);

}  // namespace isohf
