#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "ground.h"
#include "paging/tile_source.h"
#include "reading/hud.h"

namespace isohf::view {

/// What to tell a reader of a place: a line for each way to name it.
[[nodiscard]] std::vector<std::string> lines_of(const Place& place);
[[nodiscard]] nlohmann::ordered_json json_of(const Place& place);

/// How far apart two places are: metres along the body where longitudes and latitudes are known, else world units.
[[nodiscard]] double distance_between(const TileSource& source, WorldPoint from, WorldPoint to);

/// Heights between two places, of full detail, at as many points as a screen is wide.
[[nodiscard]] Profile profile_between(const TileSource& source, Ground& ground, WorldPoint from, WorldPoint to);

}  // namespace isohf::view
