#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "isohf/convert/parts/assembly.h"
#include "isohf/convert/parts/problems.h"
#include "isohf/metadata.h"
#include "isohf/parts.h"

namespace isohf {

/// Why tiles of one archive have no place in the other, one clause; empty where both lie on one lattice.
[[nodiscard]] std::string why_other_lattice(const Metadata& one, const Metadata& other);
/// The same for tiles that are compared by elevations, whatever their codes.
[[nodiscard]] std::string why_other_vertices(const Metadata& one, const Metadata& other);

/// Throws Error{kInvalidArgument} where an archive's members cannot be copied as they are: repacked.
void require_copyable(const ArchiveReader& archive);

/// "columns 0 to 5 and rows 2 to 3", for messages.
[[nodiscard]] std::string text_of(const TileRange& tiles);

/// As of its metadata; errors name the archive.
[[nodiscard]] TileRange tiles_here(const ArchiveReader& archive);

/// Says in the metadata how many seeds and textures were written, and how large.
void count_members(const ArchiveWriter& writer, Metadata& metadata);

/// What an archive is a part of; equal where parts fit together without a look at their elevations.
struct PartOrigin {
  std::string id;
  std::string whole_json;  ///< the metadata of what it was cut from, or its own where it is whole; empty for shards
  bool is_shard = false;
};
[[nodiscard]] PartOrigin origin_of(const ArchiveReader& archive);

/// Opens archives that are to be joined, all of whose bytes are held against the CRC that they state, and hands over those
/// without a problem: take(number in `archives`, archive), one at a time, in any order. Stage "check".
void check_parts(const std::vector<std::string>& archives, const std::string& output, Problems& problems,
                 const Job& job, const std::function<void(std::size_t, std::unique_ptr<ArchiveReader>)>& take);

/// What is joined, and what is said of it.
struct PartsJob {
  std::vector<AssemblyInput> inputs;
  TileRange tiles;
  Metadata metadata;       ///< counts, hashes and what says that it is a part are filled in
  std::string whole_json;  ///< as in PartOrigin; empty where the parts are of several
  bool one_origin = true;
  bool has_plane_rows = false;           ///< AssemblyRequest's
  std::optional<Statistics> statistics;  ///< where they are known; else tiles are decoded and counted
  int plane = 0;                         ///< AssemblyRequest's
};
/// Throws as merge_archives() does once it writes.
[[nodiscard]] PartSummary write_parts(PartsJob parts, const std::string& output, const PartOptions& options,
                                      const Job& job);

}  // namespace isohf
