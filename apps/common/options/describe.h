#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/archive/textures/texture_info.h"
#include "isohf/convert/frame/plan.h"

namespace isohf::cli {

/// Numbers as people read them; JSON output uses none of these.

[[nodiscard]] std::string describe_bytes(std::uint64_t bytes);  ///< "12.3 MB", powers of 1000
[[nodiscard]] std::string describe_count(std::int64_t count);   ///< "2 472 768"
[[nodiscard]] std::string describe_seconds(double seconds);     ///< "0.31 s", "4 min 05 s"
/// A horizontal length with its unit: metres, kilometres, or "units" where `metres` is false.
[[nodiscard]] std::string describe_length(double length, bool metres);

/// The projection, how far lengths err and where, and why it was taken.
[[nodiscard]] std::string describe_projection(const ProjectionRecord& record);

/// Lengths on a source's own map for those on the ground.
[[nodiscard]] std::string describe_map_scale(const MapGround& ground);

/// The map of a result: its projection, else the scale of the source's own, or why that is not known. Empty without
/// one.
[[nodiscard]] std::string describe_map(const std::optional<ProjectionRecord>& projection,
                                       const std::optional<MapGround>& ground, const std::string& why_no_map,
                                       bool wraps_x);

/// "1024 x 1024 texels a tile, 8 levels, jpeg 90: 1040 members, 12.3 MB".
[[nodiscard]] std::string describe_textures(const TextureInfo& info);

/// Bytes of one stored elevation before coding.
[[nodiscard]] int raw_bytes(CodeType type);

}  // namespace isohf::cli
