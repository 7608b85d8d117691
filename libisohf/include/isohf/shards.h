// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/convert.h"
#include "isohf/job.h"
#include "isohf/parts.h"
#include "isohf/raster.h"

/// One conversion on many machines (docs/cluster.md): a plan fixes lattice and codes, each shard is a conversion of some
/// whole rows of tiles, and joined they have the bytes of convert().

namespace isohf {

/// What all shards must agree on.
struct ShardPlan {
  std::vector<std::string> arguments;  ///< by which a program makes source and options again; the library reads none
  std::string job;                     ///< sources, lattice, options, program: equal text, equal bytes
  std::int64_t tile_columns = 0;
  std::int64_t tile_rows = 0;
  /// By the range of elevations.
  struct Codes {
    Quantisation quantisation;
    double datum = 0.0;         ///< that heights are computed from
    double height_error = 0.0;  ///< of such heights, at most
    double largest = 0.0;       ///< no elevation is meant to lie further from 0
  };
  Codes codes;
  std::optional<std::string> samples_sha256;                  ///< of all samples, for `lossless`
  std::vector<std::pair<std::int64_t, std::int64_t>> shards;  ///< rows of tiles: first, and past the last
  std::vector<Warning> warnings;  ///< of the pass over the source, where there was one; no part of what is written
};

/// Plans a conversion, with one pass over the source where its range is not given (z_range). Shards have about equally
/// many rows, and end where rows of the first coarse plane do if there are enough of these; there are no more of them
/// than rows. With `lossless` one more pass takes the samples' hash. Stages "range", "hash". Throws as convert() does, and
/// Error{kInvalidArgument} for `max_error` and `measure`, which need all rows at once.
[[nodiscard]] ShardPlan plan_shards(HeightSource& source, const ConvertOptions& options, int shards,
                                    const Job& job = {});
/// A plan as JSON, and back. parse_shard_plan() throws Error{kCorrupt} naming the member at fault, Error{kUnsupported}
/// for other versions than 2.
[[nodiscard]] std::string format_shard_plan(const ShardPlan& plan);
[[nodiscard]] ShardPlan parse_shard_plan(const std::string& json);

/// convert() of shard `number`, from 1 on. Throws Error{kInvalidArgument} also where source and options are no longer
/// those that were planned, or there is no such shard.
ConvertSummary convert_shard(HeightSource& source, const ShardPlan& plan, int number, const std::string& output,
                             const ConvertOptions& options, const Job& job = {});

/// Whether a file is that shard of the plan, complete; all of its bytes are read.
[[nodiscard]] bool is_shard(const std::string& archive, const ShardPlan& plan, int number);

/// "3,7-9": numbers of shards, ascending, as Slurm's --array takes them.
[[nodiscard]] std::string shard_list(const std::vector<int>& numbers);

/// Shards that none of the files is, ascending: also where a file is damaged, or missing.
[[nodiscard]] std::vector<int> missing_shards(const ShardPlan& plan, const std::vector<std::string>& files,
                                              const Job& job = {});

/// merge_archives() of all shards of a plan, in any order. Error{kInvalidArgument, kCorrupt} names, in one message, those
/// that are missing, there twice, damaged, or of another plan, before anything is written.
PartSummary merge_shards(const ShardPlan& plan, const std::vector<std::string>& files, const std::string& output,
                         const PartOptions& options = {}, const Job& job = {});

}  // namespace isohf
