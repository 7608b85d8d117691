#pragma once

#include <optional>
#include <string>

#include "isohf/archive/metadata/shard_record.h"
#include "isohf/convert.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/shards.h"

namespace isohf {

/// What one conversion came to.
struct ConversionResult {
  ConvertSummary summary;
  std::optional<AccuracyReport> measured;  ///< with a max_error
  bool is_finished = true;                 ///< false: the surface errs by more than max_error, nothing was left
};

/// The rows of tiles that one shard makes.
struct ShardWork {
  ShardRecord record;  ///< but for its sums
  /// Each row of the first plane is above tiles of one shard, which makes it as the whole has it.
  bool has_plane_rows = false;
};

/// make_plan() for a conversion: refuses options that none can have.
[[nodiscard]] Plan plan_conversion(const SourceInfo& info, const ConvertOptions& options);

/// ShardRange of a conversion (isohf/shards.h).
[[nodiscard]] ShardRange find_shard_range(HeightSource& source, const ConvertOptions& options, const Job& job);

/// One conversion, by a plan that was made of options.plan. `is_retry`: an interrupt leaves no part file behind, which
/// `resume` could not use.
[[nodiscard]] ConversionResult run_conversion(HeightSource& source, const Plan& plan, const std::string& output,
                                              const ConvertOptions& options, const Job& job, bool is_retry = false,
                                              const ShardWork* shard = nullptr);

}  // namespace isohf
