#include "support/rasters/analytic_surface.h"

#include <cmath>

namespace isohf::test {

std::uint16_t analytic_code(LatticeVertex vertex) {
  const double x = static_cast<double>(vertex.x) / 2.0;
  const double z = static_cast<double>(vertex.z) * std::sqrt(0.75);
  double height = 30000.0;
  height += 14000.0 * std::sin(0.031 * x + 0.4) * std::cos(0.023 * z);
  height += 7000.0 * std::sin(0.11 * x - 0.07 * z + 1.0);
  height += 2500.0 * std::cos(0.05 * x + 0.29 * z);
  std::uint64_t mixed = static_cast<std::uint64_t>(vertex.x) * 0x9E3779B97F4A7C15U ^
                        static_cast<std::uint64_t>(vertex.z) * 0xC2B2AE3D27D4EB4FU;
  mixed = (mixed ^ (mixed >> 29)) * 0xBF58476D1CE4E5B9U;
  height += static_cast<double>(mixed >> 54U) - 512.0;
  return static_cast<std::uint16_t>(std::lround(height));
}

std::vector<std::uint16_t> analytic_tile(const TileGrid& grid, TileIndex tile) {
  std::vector<std::uint16_t> codes;
  codes.reserve(static_cast<std::size_t>(grid.shape().stored_vertex_count()));
  for (int row = 0; row < grid.shape().rows(); ++row) {
    for (int column = 0; column < grid.shape().columns(); ++column) {
      codes.push_back(analytic_code(grid.lattice_vertex(tile, {column, row})));
    }
  }
  return codes;
}

}  // namespace isohf::test
