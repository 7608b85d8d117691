#include <cstdio>

#include "isohf/archive/content_hash.h"
#include "isohf/lattice/tile_shape.h"

/// Links pure geometry, and a function that stands on another library.
int main() {
  const auto shape = isohf::TileShape::make(212, 243, 4);
  std::printf("%d columns, %s\n", static_cast<int>(shape.columns()), isohf::hex(isohf::sha256({})).c_str());
  return shape.columns() == 212 ? 0 : 1;
}
