#include "isohf/archive/metadata/shard_record.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/archive/metadata/json_members.h"
#include "isohf/shards.h"

namespace isohf {

void shard_members(JsonMembers& json, ShardRecord& shard) {
  json.all("job_sha256", shard.job, "number", shard.number, "of", shard.count, "first_row", shard.first_row, "end_row",
           shard.end_row, "row_sums", shard.row_sums);
  if (json.reads() && (shard.number < 1 || shard.number > shard.count))
    json.refuse("number", fmt::format("is {} of {}", shard.number, shard.count));
}

std::string format_shard_record(const ShardRecord& record) {
  return write_extension(record, shard_members);
}

std::optional<ShardRecord> shard_record(const Metadata& metadata) {
  auto record = read_extension(metadata, kShardName, shard_members);
  if (!record) return record;
  const std::int64_t rows = metadata.grid.tile_rows();
  // Memory grows with the number of shards that one of them states.
  if (record->count > std::min<std::int64_t>(rows, kMostShards)) {
    refuse_metadata("shard.of", fmt::format("is {}, of {} rows of tiles", record->count, rows));
  }
  if (record->first_row < 0 || record->first_row >= record->end_row || record->end_row > rows) {
    refuse_metadata("shard.end_row",
                    fmt::format("makes rows {} to {}, of {} rows of tiles", record->first_row, record->end_row, rows));
  }
  if (static_cast<std::int64_t>(record->row_sums.size()) != record->end_row - record->first_row) {
    refuse_metadata("shard.row_sums", fmt::format("are {}, of {} rows of tiles", record->row_sums.size(),
                                                  record->end_row - record->first_row));
  }
  return record;
}

}  // namespace isohf
