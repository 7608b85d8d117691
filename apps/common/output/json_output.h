#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "isohf/convert/frame/plan.h"
#include "isohf/lattice.h"

namespace isohf::cli {

/// Pieces of what --json prints; members are named as in docs/cli.md.
[[nodiscard]] nlohmann::ordered_json json_from(const TileShape& shape);
[[nodiscard]] nlohmann::ordered_json json_from(const TileGrid& grid);
[[nodiscard]] nlohmann::ordered_json json_from(const WorldBounds& bounds);

/// The document as text with a newline. Bytes that are no UTF-8 (file names may hold any) are replaced.
[[nodiscard]] std::string json_text(const nlohmann::ordered_json& document);
/// The same on one line.
[[nodiscard]] std::string json_line(const nlohmann::ordered_json& document);

}  // namespace isohf::cli
