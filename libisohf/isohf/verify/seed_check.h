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
/// must be equal to the byte. Memory: the casters of one row of tiles, and the places of the members.
class SeedCheck {
 public:
  using Problem = std::pair<std::optional<TileIndex>, std::string>;

  /// The archive has seeds, and outlives this. Throws Error{kCorrupt} where their record cannot be used.
  SeedCheck(const ArchiveReader& archive, const ShadowSeedInfo& info);

  /// The tiles of a row, nullptr where one is not stored. On the caller's oneTBB arena.
  [[nodiscard]] std::vector<Problem> check_row(std::int64_t row, std::span<const TileCodes* const> tiles) const;
  /// What the record says of all members together.
  [[nodiscard]] std::vector<Problem> check_record() const;

 private:
  [[nodiscard]] std::string why_wrong(TileIndex tile, const EncodedSeeds& expected) const;

  const ArchiveReader& archive_;
  ShadowSeedInfo info_;
  SeedRow row_;
  std::vector<std::pair<std::int64_t, const MemberEntry*>> members_;  ///< by flat tile index
};

}  // namespace isohf
