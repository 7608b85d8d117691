#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "isohf/lattice.h"

namespace isohf::test {

/// Changes a tile's codes before they are stored.
using AlterTile = std::function<void(TileIndex, std::vector<std::uint16_t>&)>;

/// Writes an archive of the analytic surface (analytic_surface.h) straight through ArchiveWriter, without a source:
/// 16-bit codes, elevation = -20 + 0.002 * code. Replaces what is there.
void write_analytic_archive(const std::string& path, const TileGrid& grid, const AlterTile& alter = {});

}  // namespace isohf::test
