#pragma once

#include <optional>
#include <string>

#include "isohf/archive/metadata/part_record.h"
#include "isohf/convert.h"
#include "isohf/convert/conversion.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/shards.h"

namespace isohf {

/// What one conversion came to.
struct ConversionResult {
  ConvertSummary summary;
  std::optional<AccuracyReport> measured;  ///< by options.measure, or where there is a max_error
  bool is_finished = true;                 ///< false: the surface errs by more than max_error, nothing was left
};

/// The rows of tiles that one shard of a plan makes, and what the plan found.
struct ShardWork {
  std::int64_t first_row;
  std::int64_t end_row;
  ShardPlan::Codes codes;
  PartRecord::Shard record;  ///< but for its sums
  std::optional<std::string> samples_sha256;
  bool has_plane_rows =
      false;  ///< each row of the first plane is above tiles of one shard, which makes it as the whole has it
};

/// make_plan() for a conversion: refuses options that none can have.
[[nodiscard]] Plan plan_conversion(const SourceInfo& info, const ConvertOptions& options);

/// Codes alone: the first pass over the source, where one is needed. `plan` must be made of options.plan.
[[nodiscard]] ShardPlan::Codes find_codes(HeightSource& source, const Plan& plan, const ConvertOptions& options,
                                          const Job& job, std::vector<Warning>& warnings);
/// One conversion, by a plan that was made of options.plan. `is_retry`: an interrupt leaves no part file behind, which
/// `resume` could not use.
[[nodiscard]] ConversionResult run_conversion(HeightSource& source, const Plan& plan, const std::string& output,
                                              const ConvertOptions& options, const Job& job, bool is_retry = false,
                                              const ShardWork* shard = nullptr);

}  // namespace isohf
