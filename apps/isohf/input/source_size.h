#pragma once

#include <cstdint>
#include <string>

#include "isohf/metadata.h"

namespace isohf::cli {

/// What elevations take beside the source's own samples; of a part beside those on its ground.
struct SizeBesideSource {
  SizeBesideSource(const Metadata& metadata, std::uint64_t tile_bytes);

  std::uint64_t source_samples = 0;
  std::uint64_t source_bytes = 0;       ///< of these, in their own type
  double bits_per_source_sample = 0.0;  ///< of the tiles
  double ratio_to_source = 0.0;         ///< source_bytes / tile bytes; 0 where there are no tiles
  bool is_part = false;
};
[[nodiscard]] std::string describe_size(const Metadata& metadata, std::uint64_t tile_bytes);

/// Aspect of the triangles as they are drawn; 1 is equilateral. TileShape::aspect() of square tiles.
[[nodiscard]] double triangle_aspect(const TileGrid& grid);

}  // namespace isohf::cli
