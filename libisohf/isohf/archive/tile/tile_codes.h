#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "isohf/archive.h"

namespace isohf {

using Digest = std::array<std::byte, 32>;  ///< SHA-256

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
  bool is_empty = false;      ///< every vertex is void: nothing to store
  TileStatistics statistics;  ///< filled in by whoever made the codes
  Digest content_digest{};    ///< of the codes, little-endian, void included
};

/// Members of one folder and their compressed bytes.
struct MemberTotals {
  std::int64_t members = 0;
  std::uint64_t bytes = 0;
};

}  // namespace isohf
