#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive.h"
#include "isohf/archive/planes/plane_builder.h"
#include "isohf/tile_range.h"

namespace isohf {

/// Makes an archive's coarse planes once more from its tiles: their elevations must be equal, and the index must state
/// the ranges of what lies below. Memory: a row of each plane's tiles.
class PlaneCheck {
 public:
  using Problem = std::pair<int, std::string>;  ///< id of a finding, what

  /// The archive has planes, and outlives this.
  PlaneCheck(const ArchiveReader& archive, const ScratchFolder& scratch);

  /// The next tile in flat order, nullptr where it is not stored, and its range as found in it. On the caller's oneTBB
  /// arena.
  void add(const TileCodes* codes, std::uint32_t code_min, std::uint32_t code_max);
  /// What was found since.
  [[nodiscard]] std::vector<Problem> problems() { return std::exchange(problems_, {}); }

 private:
  void check(int plane, TileIndex tile, const EncodedTile& expected);

  const ArchiveReader& archive_;
  PlaneBuilder builder_;
  std::vector<Problem> problems_;
};

}  // namespace isohf
