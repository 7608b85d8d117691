#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "isohf/archive.h"
#include "isohf/convert/stages/seed_row.h"

namespace isohf {

/// Makes an archive's shadow seeds once more from its tiles. Seeds follow from the codes bit for bit, so that members
/// must be equal to the byte. Memory: the casters of one row of tiles, unless in a scratch file.
class SeedCheck {
 public:
  using Problem = std::pair<std::optional<TileIndex>, std::string>;

  /// The archive has seeds, and outlives this. Throws Error{kCorrupt} where their record cannot be used.
  SeedCheck(const ArchiveReader& archive, const ShadowSeedInfo& info, const ScratchFolder& scratch);

  /// Of any tile, nullptr where it is not stored; on any thread.
  [[nodiscard]] SeedRow::Tile prepare(TileIndex index, const TileCodes* codes) const;
  /// The next tile of a row, from West to East.
  void add(const SeedRow::Tile& tile) { tiles_.add(tile); }
  /// Whether the row that has been added is to be checked, or forgotten. On the caller's oneTBB arena.
  [[nodiscard]] std::vector<Problem> end_row(std::int64_t row, bool check);
  /// What the record says of all members together.
  [[nodiscard]] std::vector<Problem> check_record() const;

 private:
  [[nodiscard]] std::string why_wrong(TileIndex tile, const EncodedSeeds& expected) const;

  const ArchiveReader& archive_;
  ShadowSeedInfo info_;
  SeedRow row_;
  SeedRow::Tiles tiles_;
};

}  // namespace isohf
