#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isohf/metadata.h"
#include "isohf/tile_range.h"

namespace isohf {

/// The metadata's extension of an archive that holds a part of its lattice: which tiles are to be here. Of the others it
/// says nothing, not even that they are void.
struct PartRecord {
  struct Shard {
    std::string plan;  ///< its SHA-256
    int number = 0;    ///< 1 to `shards`
    int shards = 0;
    std::vector<double> row_sums;  ///< sums of elevations by row of tiles, as statistics count them
  };
  TileRange tiles;
  std::optional<Shard> shard;  ///< of a plan, where it is one
};
class JsonMembers;
void part_members(JsonMembers& json, PartRecord& part);

inline constexpr const char* kPartName = "part";
/// The metadata's member that holds a digest of the options and of what the source says of itself, without its path,
/// size and time.
inline constexpr const char* kJobName = "job_sha256";
/// The member of a part that holds the metadata of the archive that it was cut from.
inline constexpr const char* kWholeName = "whole.json";

[[nodiscard]] std::string format_part_record(const PartRecord& record);
/// nullopt where the archive is whole. Throws Error{kCorrupt}.
[[nodiscard]] std::optional<PartRecord> part_record(const Metadata& metadata);
/// The tiles that are to be in an archive: a part's, or all.
[[nodiscard]] TileRange tiles_here(const Metadata& metadata);
[[nodiscard]] TileRange all_tiles(const TileGrid& grid);

}  // namespace isohf
