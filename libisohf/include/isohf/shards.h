// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "isohf/convert.h"
#include "isohf/job.h"
#include "isohf/parts.h"
#include "isohf/raster.h"

/// One conversion on many machines (docs/cluster.md): each shard is a conversion of some whole rows of tiles, with the
/// same source and options, and merged they have the bytes of convert().

namespace isohf {

/// The most shards of a conversion.
inline constexpr int kMostShards = 1000000;

/// Shard `number` of `count`, from 1 on.
struct ShardNumber {
  int number = 1;
  int count = 1;
};

/// "3/64". Throws Error{kInvalidArgument} "found ..., must be ...".
[[nodiscard]] ShardNumber shard_number_from_string(const std::string& text);

/// What no shard can know alone: a `z_range` of all elevations, and the step of the codes that suit them.
struct ShardRange {
  double min = 0.0;
  double max = 0.0;
  double step = 0.0;
};
/// Reads the whole source, as convert() without `z_range` does, and widens what it finds to whole steps: no elevation
/// lies outside. nullopt for `code_type` f32, which needs no range. Throws Error{kInvalidArgument} if there is no such
/// shard.
[[nodiscard]] std::optional<ShardRange> shard_range(HeightSource& source, const ShardNumber& shard,
                                                    const ConvertOptions& options, const Job& job = {});

/// convert() of one shard, a work file that merge_shards() reads. Shards have about equally many rows of tiles, and end
/// where rows of the first coarse plane do if there are enough of these. `lossless` reads all samples once more, for
/// their hash. Throws as convert() does, and Error{kInvalidArgument} if there is no such shard, for `max_error`,
/// which needs all rows at once, and for codes without `z_range`.
ConvertSummary convert_shard(HeightSource& source, const ShardNumber& shard, const std::string& output,
                             const ConvertOptions& options, const Job& job = {});

/// Whether a file is that shard of the conversion, complete; all of its bytes are read.
[[nodiscard]] bool is_shard(const std::string& file, const HeightSource& source, const ShardNumber& shard,
                            const ConvertOptions& options);

/// "3,7-9": numbers of shards, ascending, as Slurm's --array reads them.
[[nodiscard]] std::string shard_list(const std::vector<int>& numbers);

/// Numbers that none of the files has, ascending; a file that is damaged, or of another conversion than the first, does
/// not count.
struct MissingShards {
  std::vector<int> numbers;
  int count = 0;  ///< of all shards
};
/// Throws Error if none of the files is a shard.
[[nodiscard]] MissingShards missing_shards(const std::vector<std::string>& files, const Job& job = {});

/// Joins all shards of a conversion, in any order, to its archive. Error{kInvalidArgument, kCorrupt} names, in one
/// message, those that are missing, there twice, damaged, or of another conversion, before anything is written. Stages
/// "check", "tiles".
PartSummary merge_shards(const std::vector<std::string>& files, const std::string& output,
                         const PartOptions& options = {}, const Job& job = {});

}  // namespace isohf
