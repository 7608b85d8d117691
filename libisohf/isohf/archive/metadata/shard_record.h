#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/metadata.h"

namespace isohf {

/// The metadata's member of a shard: a work file that has some rows of tiles of a conversion, and that is merged with
/// the others to its archive.
struct ShardRecord {
  std::string job;  ///< SHA-256 of all that decides the bytes of the conversion
  int number = 0;   ///< 1 to `count`
  int count = 0;
  std::int64_t first_row = 0;    ///< of tiles
  std::int64_t end_row = 0;      ///< past the last
  std::vector<double> row_sums;  ///< sums of elevations by row of tiles, as statistics count them
};
class JsonMembers;
void shard_members(JsonMembers& json, ShardRecord& shard);

inline constexpr const char* kShardName = "shard";
/// The metadata's member that has a digest of the options and of the source's description, without its path, size and
/// time.
inline constexpr const char* kJobName = "job_sha256";

[[nodiscard]] std::string format_shard_record(const ShardRecord& record);
/// nullopt for an archive. Throws Error{kCorrupt}.
[[nodiscard]] std::optional<ShardRecord> shard_record(const Metadata& metadata);

}  // namespace isohf
