#include "isohf/archive/shadow_seeds/shadow_seed_reader.h"

#include <fmt/format.h>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/error.h"

namespace isohf {
namespace {

ShadowSeedInfo info_of(const ArchiveReader& archive) {
  const auto info = shadow_seed_info(archive.metadata());
  if (!info) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: has no shadow seeds; convert with `shadow_seeds`", archive.path()));
  }
  return *info;
}

}  // namespace

ShadowSeedReader::ShadowSeedReader(const ArchiveReader& archive) : archive_(archive), info_(info_of(archive)) {}

std::vector<std::byte> ShadowSeedReader::payload(TileIndex index) const {
  if (!archive_.grid().contains(index)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: tile ({},{}) lies outside the grid", archive_.path(), index.column, index.row));
  }
  const auto found = archive_.find_member(seed_name(index));
  if (!found) return {};
  // More than all vertices of its row would take, each a caster.
  const TileGrid& grid = archive_.grid();
  const auto vertices = static_cast<std::uint64_t>(grid.shape().stored_vertex_count() * grid.tile_columns());
  if (found->bytes > 32 * vertices + 1024) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: member \"{}\" has {} bytes, too many for {} vertices",
                                                 archive_.path(), found->name, found->bytes, vertices));
  }
  return archive_.read_member(*found);
}

HullSeeds ShadowSeedReader::hulls(TileIndex index, const TileCodes& tile) const {
  const std::vector<std::byte> bytes = payload(index);
  if (bytes.empty()) {
    CasterRows none;
    none.starts.assign(static_cast<std::size_t>(visible_rows(archive_.grid().shape())) + 1, 0);
    return {none, none};
  }
  try {
    return decode_hull_seeds(archive_.grid(), index, tile_edges(archive_.grid().shape(), tile), bytes);
  } catch (const Error& error) {
    throw error.within(fmt::format("{}: member \"{}\"", archive_.path(), seed_name(index)));
  }
}

}  // namespace isohf
