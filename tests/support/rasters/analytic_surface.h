#pragma once

#include <cstdint>
#include <vector>

#include "isohf/lattice.h"

namespace isohf::test {

/// A rough surface that is a pure function of the lattice vertex, so that tiles that share a vertex agree: hills of
/// several sizes and a little noise. Codes from 1000 to about 60000.
[[nodiscard]] std::uint16_t analytic_code(LatticeVertex vertex);

/// The C*R codes of one tile, padding included.
[[nodiscard]] std::vector<std::uint16_t> analytic_tile(const TileGrid& grid, TileIndex tile);

}  // namespace isohf::test
