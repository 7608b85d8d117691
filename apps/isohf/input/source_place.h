#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "isohf/metadata.h"
#include "isohf/projection/reference_map.h"
#include "isohf/raster.h"

namespace isohf::cli {

/// Where a source lies: the outer edges of what its samples stand for, in its own coordinates and in degrees.
struct SourcePlace {
  MapBounds bounds;
  HorizontalUnit unit = HorizontalUnit::kUnknown;
  std::optional<MapGround> ground;  ///< nullopt where it is not known
  bool has_map_scale = false;       ///< of ground: the source lies on a map
  std::string why_no_ground;        ///< in one line; empty where no reference system is named
};

/// nullopt where the place has no origin. PROJ is loaded only for maps whose ground is not `stored`.
[[nodiscard]] std::optional<SourcePlace> source_place(const Georeference& place, std::int64_t width,
                                                      std::int64_t height, bool is_area,
                                                      const std::optional<MapGround>& stored = std::nullopt);
[[nodiscard]] std::optional<SourcePlace> source_place(const Metadata& metadata);

/// Lines of info: name, blanks, value.
[[nodiscard]] std::string text_from(const SourcePlace& place);
/// Members bounds, centre, lonlat and map_scale; null where not known.
void add_source_place(const std::optional<SourcePlace>& place, nlohmann::ordered_json& json);

}  // namespace isohf::cli
