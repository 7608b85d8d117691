#pragma once

#include <cstdint>

#include "isohf/metadata.h"

namespace isohf {

/// Bytes of an archive's elevations, compared with the samples of its source; for an extract with those on its ground.
struct SizeBesideSource {
  SizeBesideSource(const Metadata& metadata, std::uint64_t tile_bytes);

  std::uint64_t source_samples = 0;
  std::uint64_t source_bytes = 0;       ///< in the source's own sample type
  double bits_per_source_sample = 0.0;  ///< of the tiles
  double ratio_to_source = 0.0;         ///< source_bytes / tile bytes; 0 if there are no tiles
};

}  // namespace isohf
