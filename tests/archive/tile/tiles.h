#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "isohf/archive/tile/tile_codes.h"
#include "isohf/archive/tile/tile_encoder.h"
#include "isohf/error.h"
#include "isohf/metadata.h"

/// Tiles and archives to test with.

namespace isohf::test {

/// What a tile's samples look like.
enum class Kind { kConstant, kPlane, kTerrain, kNoise, kExtremes, kTwoLevels, kVoidIsland, kVoidNoise, kAllVoid };

inline constexpr Kind kAllKinds[] = {Kind::kConstant,   Kind::kPlane,     Kind::kTerrain,
                                     Kind::kNoise,      Kind::kExtremes,  Kind::kTwoLevels,
                                     Kind::kVoidIsland, Kind::kVoidNoise, Kind::kAllVoid};

/// A tile of that kind; the same arguments give the same tile.
[[nodiscard]] TileCodes make_tile(const TileShape& shape, CodeType type, Kind kind, std::uint32_t seed);

/// Its payload, inflated.
[[nodiscard]] std::vector<std::byte> payload_of(const EncodedTile& tile);

/// The tile, or nothing where `decode` refuses the payload.
template <typename Decode>
std::optional<TileCodes> decoded_by(const Decode& decode, const TileShape& shape, CodeType type,
                                    std::span<const std::byte> payload) {
  try {
    return decode(shape, type, payload);
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// 5 x 4 tiles of 12 x 11 vertices.
[[nodiscard]] TileGrid small_grid();

/// NaN equals NaN; otherwise bits decide.
[[nodiscard]] bool same_samples(const TileCodes& a, const TileCodes& b);

/// Metadata for that grid with every member filled in.
[[nodiscard]] Metadata make_metadata(const TileGrid& grid, CodeType type);

/// The tile that make_archive puts at a place: kinds in turn.
[[nodiscard]] TileCodes tile_of_archive(const TileGrid& grid, CodeType type, std::int64_t flat);

/// Writes a small archive with tiles of all kinds, a stored and a deflated member.
void make_archive(const std::string& path, const TileGrid& grid, CodeType type);

}  // namespace isohf::test
