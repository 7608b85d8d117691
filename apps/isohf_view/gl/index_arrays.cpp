#include "gl/index_arrays.h"

#include "isohf/lattice/stitch.h"
#include "isohf/lattice/strip.h"

namespace isohf::view {

IndexArrays make_index_arrays(const TileShape& shape) {
  IndexArrays arrays;
  for (int level = 0; level < shape.levels(); ++level) {
    arrays.strips.push_back(strip_indices(shape, level));
    arrays.stitch_counts.push_back(static_cast<std::size_t>(shape.stitch_index_count(level)));
  }
  arrays.stitch = stitch_indices(shape);
  return arrays;
}

}  // namespace isohf::view
