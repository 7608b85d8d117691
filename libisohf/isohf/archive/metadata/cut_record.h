#pragma once

#include <algorithm>
#include <optional>
#include <string>

#include "isohf/archive/metadata/json_members.h"
#include "isohf/metadata.h"

namespace isohf {

/// The metadata's member of an archive that was extracted.
inline constexpr const char* kCutName = "cut";
struct CutRecord {
  std::int64_t column = 0;  ///< the tile of the larger archive that its first tile was
  std::int64_t row = 0;
  std::optional<std::int64_t> coarser;  ///< of a plane: steps of its lattice, in those of the one that was converted
};

inline void cut_members(JsonMembers& json, CutRecord& cut) {
  json("column", cut.column);
  json("row", cut.row);
  json("coarser", cut.coarser, {.presence = JsonRule::kAbsent, .least = 1.0, .most = 0x1p32});
}

[[nodiscard]] inline std::optional<CutRecord> cut_record(const Metadata& metadata) {
  return read_extension(metadata, kCutName, cut_members);
}

/// Whether samples of the source may lie beyond the tiles.
[[nodiscard]] inline bool is_cut(const Metadata& metadata) {
  return std::ranges::any_of(metadata.extensions, [](const auto& extension) { return extension.first == kCutName; });
}

}  // namespace isohf
