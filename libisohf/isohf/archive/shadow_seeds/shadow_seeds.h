#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/lattice/shadow_path.h"
#include "isohf/metadata.h"

/// Shadow seeds as members of an archive (docs/archive_format.md, "Shadow seeds"): what the tiles before it cast over a
/// tile's edge, for light travelling either way: hulls, which hold for every sun elevation from sun_min_deg on.

namespace isohf {

/// The metadata's member "shadow_seeds".
struct ShadowSeedInfo {
  double sun_min_deg = 2.0;  ///< the lowest sun that they hold for
  /// Elevation units in the length of one world unit: 1 where both are metres or either is unknown.
  double elevation_units_per_world_unit = 1.0;
  std::int64_t members = 0;  ///< tiles that have seeds
  std::uint64_t bytes = 0;   ///< of their members, compressed

  /// What a shadow loses in one half lattice step, in codes (elevation units for kF32), under that sun.
  [[nodiscard]] double fall_per_half_step(const TileGrid& grid, const Quantisation& quantisation,
                                          double sun_elevation_deg) const;
};

inline constexpr const char* kShadowSeedsName = "shadow_seeds";  ///< of the metadata's extension
inline constexpr double kMinSunDeg = 0.01;                       ///< sun elevations lie from here to below 90 degrees

class JsonMembers;
void shadow_seed_members(JsonMembers& json, ShadowSeedInfo& info);

/// The extension's JSON.
[[nodiscard]] std::string format_shadow_seed_info(const ShadowSeedInfo& info);
/// The record of an archive's metadata; nullopt where it has no seeds. Throws Error{kCorrupt} naming the member at
/// fault, kUnsupported for other kinds.
[[nodiscard]] std::optional<ShadowSeedInfo> shadow_seed_info(const Metadata& metadata);

/// "seeds/ROW/COLUMN.seed", as tiles are named.
[[nodiscard]] std::string seed_name(TileIndex tile);
/// The tile of such a name; nullopt where it is none in exactly that form.
[[nodiscard]] std::optional<TileIndex> tile_from_seed_name(std::string_view name);

/// The casters that act on one tile, seen from the edge where their shadows enter: West for light that travels
/// eastwards. They lie beyond the last vertex before that edge, which the tile stores as padding.
struct HullSeeds {
  CasterRows eastward;
  CasterRows westward;
  [[nodiscard]] bool empty() const { return eastward.casters.empty() && westward.casters.empty(); }
};

/// The padding West and East of a tile's visible rows: what heights are coded on.
struct TileEdges {
  CodeType type = CodeType::kU16;
  std::vector<double> west;  ///< [R-2] codes (kF32: elevations), NaN where void
  std::vector<double> east;
};
[[nodiscard]] TileEdges tile_edges(const TileShape& shape, const TileCodes& tile);

/// A member, compressed.
struct EncodedSeeds {
  std::vector<std::byte> deflated;
  std::uint32_t payload_bytes = 0;
  std::uint32_t payload_crc32 = 0;
};

/// Codes the seeds of a tile. Heights of codes are whole numbers. Deterministic, thread-safe. The grid must satisfy
/// has_room_for_seeds.
[[nodiscard]] EncodedSeeds encode_seeds(const TileGrid& grid, const TileEdges& edges, const HullSeeds& seeds);

/// The inverse, from the inflated member. Trusts nothing: throws Error{kCorrupt} for whatever encode_seeds would not
/// have made of a tile in that place and cannot be read exactly, kUnsupported for a version of the future. Thread-safe.
[[nodiscard]] HullSeeds decode_hull_seeds(const TileGrid& grid, TileIndex index, const TileEdges& edges,
                                          std::span<const std::byte> payload);

/// False for grids of 2^31 vertices in a row and more.
[[nodiscard]] bool has_room_for_seeds(const TileGrid& grid);

}  // namespace isohf
