#pragma once

#include <cstdint>
#include <vector>

#include "isohf/lattice.h"

namespace isohf::view {

/// The index arrays that all tiles of one shape share, as the library makes them. Verifying takes altered ones too.
struct IndexArrays {
  std::vector<std::vector<std::uint32_t>> strips;  ///< by level
  std::vector<std::uint32_t> stitch;               ///< level λ draws the first stitch_counts[λ]
  std::vector<std::size_t> stitch_counts;          ///< by level
};

[[nodiscard]] IndexArrays make_index_arrays(const TileShape& shape);

}  // namespace isohf::view
