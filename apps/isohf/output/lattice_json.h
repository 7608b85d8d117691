#pragma once

#include <nlohmann/json_fwd.hpp>

#include "isohf/convert/frame/plan.h"
#include "isohf/lattice.h"

namespace isohf::cli {

/// Pieces of what --json prints (docs/schema/common.json).
[[nodiscard]] nlohmann::ordered_json json_from(const TileShape& shape);
[[nodiscard]] nlohmann::ordered_json json_from(const TileGrid& grid);
[[nodiscard]] nlohmann::ordered_json json_from(const WorldBounds& bounds);

}  // namespace isohf::cli
