#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "isohf/archive/metadata.h"
#include "isohf/lattice/tile_shape.h"

namespace isohf {

/// The C*R elevations of one tile, row by row, as stored: 16-bit codes (kU16 and kU8) or floats (kF32). Exactly one of
/// the two vectors is in use.
struct TileCodes {
  CodeType type = CodeType::kU16;
  std::vector<std::uint16_t> codes;  ///< kU16, kU8; void as in Quantisation::void_code()
  std::vector<float> heights;        ///< kF32; void is NaN

  friend bool operator==(const TileCodes&, const TileCodes&) = default;
};

/// What is known of one tile's visible vertices; the writer journals it and adds the tiles up in order.
struct TileStatistics {
  std::int64_t vertices = 0;
  std::int64_t voids = 0;
  std::int64_t clamped = 0;  ///< stored vertices moved to the end of the z range
  double sum = 0.0;          ///< of the elevations that are not void
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  double worst_rounding = 0.0;  ///< largest |stored - computed|
};

/// A tile without an elevation.
[[nodiscard]] TileCodes void_tile(const TileShape& shape, const Quantisation& quantisation);

/// A tile, coded and compressed, ready to be written as an archive member.
struct EncodedTile {
  std::vector<std::byte> deflated;  ///< raw Deflate stream (RFC 1951)
  std::uint32_t payload_bytes = 0;  ///< size once inflated
  std::uint32_t payload_crc32 = 0;  ///< CRC-32 (ZIP's) of the inflated payload
  std::uint32_t code_min = 0;       ///< smallest and largest code that is not void; float bits for kF32
  std::uint32_t code_max = 0;
  bool has_voids = false;
  bool is_empty = false;                  ///< every vertex is void: nothing to store
  TileStatistics statistics;              ///< filled in by whoever made the codes
  std::vector<std::byte> content_digest;  ///< SHA-256 of the codes, little-endian, void included: 32 bytes
};

/// How hard the encoder tries: the higher, the fewer bytes and the slower. Readers need not know.
inline constexpr int kMinLevel = 1;
inline constexpr int kMaxLevel = 12;
inline constexpr int kDefaultLevel = 5;

/// Codes one tile: hexagonal prediction, residuals in context streams, Deflate. Deterministic; thread-safe.
/// `tile` holds shape.stored_vertex_count() samples; `level` is kMinLevel to kMaxLevel. Never fails on data; throws
/// Error{kOutOfMemory}, and Error{kInvalidArgument} for another level.
[[nodiscard]] EncodedTile encode_tile(const TileShape& shape, const TileCodes& tile, int level = kDefaultLevel);

/// Decodes one tile from its inflated payload. Trusts nothing: throws Error{kCorrupt} for whatever encode_tile would
/// not have made and that cannot be read exactly, Error{kUnsupported} for a codec version of the future. Thread-safe.
[[nodiscard]] TileCodes decode_tile(const TileShape& shape, CodeType type, std::span<const std::byte> payload);

/// The same by the plain loop alone, one sample after the other: what decode_tile is held against.
[[nodiscard]] TileCodes decode_tile_slowly(const TileShape& shape, CodeType type, std::span<const std::byte> payload);

}  // namespace isohf
