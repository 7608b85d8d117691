#pragma once

#include <algorithm>
#include <string>

#include "isohf/metadata.h"

namespace isohf {

/// The metadata's member of an archive that was extracted: the tile of the larger archive that its first tile was.
inline constexpr const char* kCutName = "cut";

[[nodiscard]] inline std::string format_cut(TileIndex first) {
  return "{\"column\": " + std::to_string(first.column) + ", \"row\": " + std::to_string(first.row) + "}";
}

/// Whether samples of the source may lie beyond the tiles.
[[nodiscard]] inline bool is_cut(const Metadata& metadata) {
  return std::ranges::any_of(metadata.extensions, [](const auto& extension) { return extension.first == kCutName; });
}

}  // namespace isohf
