#include "isohf/verify/seed_check.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include <algorithm>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/error.h"

namespace isohf {

SeedCheck::SeedCheck(const ArchiveReader& archive, const ShadowSeedInfo& info, const ScratchFolder& scratch)
    : archive_(archive),
      info_(info),
      row_(archive.grid(), archive.metadata().quantisation, info, archive.metadata().valid),
      tiles_(scratch) {
  if (!has_room_for_seeds(archive.grid())) {
    throw Error(ErrorCode::kCorrupt, "shadow_seeds: a grid of so many columns has none");
  }
  for (const MemberEntry& member : archive.members()) {
    const auto tile = tile_from_seed_name(member.name);
    if (tile && archive.grid().contains(*tile)) members_.emplace_back(archive.grid().flat_index(*tile), &member);
  }
  std::sort(members_.begin(), members_.end());
}

/// Empty where nothing is.
std::string SeedCheck::why_wrong(TileIndex tile, const EncodedSeeds& expected) const {
  const std::int64_t flat = archive_.grid().flat_index(tile);
  const auto found =
      std::lower_bound(members_.begin(), members_.end(), std::pair(flat, static_cast<const MemberEntry*>(nullptr)));
  const bool is_there = found != members_.end() && found->first == flat;
  const bool is_due = expected.payload_bytes != 0;
  if (is_there != is_due) {
    return is_due ? "its shadow seeds are missing" : "has shadow seeds, but nothing casts a shadow into it";
  }
  if (!is_due) return {};
  std::vector<std::byte> payload(expected.payload_bytes);
  inflate_exactly(expected.deflated, payload);
  try {
    if (found->second->bytes == payload.size() && archive_.read_member(*found->second) == payload) return {};
  } catch (const Error& error) {
    return error.what();
  }
  return fmt::format("member \"{}\" holds shadow seeds that are not those of the tiles in its row",
                     found->second->name);
}

SeedRow::Tile SeedCheck::prepare(TileIndex index, const TileCodes* codes) const {
  if (codes != nullptr) return row_.prepare(index, *codes);
  return {{no_casters(archive_.grid().shape()), no_casters(archive_.grid().shape())}, {}, true};
}

std::vector<SeedCheck::Problem> SeedCheck::end_row(std::int64_t row, bool check) {
  std::vector<Problem> problems;
  const SeedRow::Take compare = [&](std::size_t first, std::span<const EncodedSeeds> expected) {
    const auto index = [&](std::size_t i) { return TileIndex{static_cast<std::int64_t>(first + i), row}; };
    std::vector<std::string> wrong(expected.size());
    oneapi::tbb::parallel_for(std::size_t{0}, wrong.size(),
                              [&](std::size_t i) { wrong[i] = why_wrong(index(i), expected[i]); });
    for (std::size_t i = 0; i < wrong.size(); ++i) {
      if (!wrong[i].empty()) problems.emplace_back(index(i), std::move(wrong[i]));
    }
  };
  if (check) row_.encode(tiles_, compare);
  tiles_.clear();
  return problems;
}

std::vector<SeedCheck::Problem> SeedCheck::check_record() const {
  std::vector<Problem> problems;
  std::uint64_t bytes = 0;
  for (const auto& [flat, member] : members_) bytes += member->compressed_bytes;
  const auto members = static_cast<std::int64_t>(members_.size());
  if (members != info_.members) {
    problems.emplace_back(std::nullopt,
                          fmt::format("{} members hold shadow seeds, the metadata says {}", members, info_.members));
  }
  // Another archiver compresses otherwise.
  if (bytes != info_.bytes && !archive_.reads_by_directory()) {
    problems.emplace_back(std::nullopt,
                          fmt::format("shadow seeds take {} bytes, the metadata says {}", bytes, info_.bytes));
  }
  return problems;
}

}  // namespace isohf
