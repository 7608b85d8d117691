#include "isohf/archive/metadata/part_record.h"

#include <fmt/format.h>

#include "isohf/archive/metadata/json_members.h"

namespace isohf {
namespace {

void shard_members(JsonMembers& json, PartRecord::Shard& shard) {
  json.all("plan_sha256", shard.plan, "number", shard.number, "of", shard.shards, "row_sums", shard.row_sums);
  if (json.reads() && (shard.number < 1 || shard.number > shard.shards))
    json.refuse("number", fmt::format("is {} of {}", shard.number, shard.shards));
}

}  // namespace

void part_members(JsonMembers& json, PartRecord& part) {
  json.object("first", "column", part.tiles.first.column, "row", part.tiles.first.row);
  json.object("end", "column", part.tiles.end.column, "row", part.tiles.end.row);
  json.object("shard", part.shard, shard_members, {.presence = JsonRule::kAbsent});
}

std::string format_part_record(const PartRecord& record) {
  return write_extension(record, part_members);
}

std::optional<PartRecord> part_record(const Metadata& metadata) {
  auto record = read_extension(metadata, kPartName, part_members);
  if (!record) return record;
  const TileRange& tiles = record->tiles;
  const auto refuse = [](const char* member, const std::string& why) {
    refuse_metadata(fmt::format("{}.{}", kPartName, member), why);
  };
  const TileGrid& grid = metadata.grid;
  if (tiles.is_empty() || intersection(tiles, all_tiles(grid)) != tiles) {
    refuse("end", fmt::format("makes columns {} to {} and rows {} to {}, of {}x{} tiles", tiles.first.column,
                              tiles.end.column, tiles.first.row, tiles.end.row, grid.tile_columns(), grid.tile_rows()));
  }
  const std::int64_t rows = tiles.end.row - tiles.first.row;
  if (record->shard && static_cast<std::int64_t>(record->shard->row_sums.size()) != rows) {
    refuse("shard.row_sums", fmt::format("are {}, of {} rows of tiles", record->shard->row_sums.size(), rows));
  }
  return record;
}

TileRange all_tiles(const TileGrid& grid) {
  return {{0, 0}, {grid.tile_columns(), grid.tile_rows()}};
}

TileRange tiles_here(const Metadata& metadata) {
  const auto part = part_record(metadata);
  return part ? part->tiles : all_tiles(metadata.grid);
}

}  // namespace isohf
