#include "isohf/verify/seed_check.h"

#include <fmt/format.h>
#include <oneapi/tbb/parallel_for.h>

#include "isohf/archive/deflate/deflate.h"
#include "isohf/error.h"
#include "isohf/verify/metadata_check.h"

namespace isohf {

SeedCheck::SeedCheck(const ArchiveReader& archive, const ShadowSeedInfo& info, const ScratchFolder& scratch)
    : archive_(archive),
      info_(info),
      row_(archive.grid(), archive.metadata().quantisation, info, archive.metadata().valid),
      tiles_(scratch) {
  if (!has_room_for_seeds(archive.grid())) {
    throw Error(ErrorCode::kCorrupt, "shadow_seeds: a grid of so many columns has none");
  }
}

/// Empty where nothing is.
std::string SeedCheck::why_wrong(TileIndex tile, const EncodedSeeds& expected) const {
  const bool is_due = expected.payload_bytes != 0;
  try {
    const auto found = archive_.find_member(seed_name(tile));
    if (found.has_value() != is_due) {
      return is_due ? "its shadow seeds are missing" : "has shadow seeds, but nothing casts a shadow into it";
    }
    if (!is_due) return {};
    std::vector<std::byte> payload(expected.payload_bytes);
    inflate_exactly(expected.deflated, payload);
    if (found->bytes == payload.size() && archive_.read_member(*found) == payload) return {};
  } catch (const Error& error) {
    return error.what();
  }
  return fmt::format("member \"{}\" has shadow seeds that are not those of the tiles in its row", seed_name(tile));
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

std::vector<SeedCheck::Problem> SeedCheck::check_record() const try {
  std::vector<Problem> problems;
  const auto is_seed = [](const std::string& name) { return tile_from_seed_name(name).has_value(); };
  const auto [members, bytes] = members_in(archive_, "seeds/{row}/{column}.seed", is_seed);
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
} catch (const Error& error) {
  return {{std::nullopt, error.what()}};
}

}  // namespace isohf
