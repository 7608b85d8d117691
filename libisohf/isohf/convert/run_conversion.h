#pragma once

#include <optional>
#include <string>

#include "isohf/convert.h"
#include "isohf/convert/frame/plan.h"

namespace isohf {

/// What one conversion came to.
struct ConversionResult {
  ConvertSummary summary;
  std::optional<AccuracyReport> measured;  ///< by options.measure, or where there is a max_error
  bool is_finished = true;                 ///< false: the surface errs by more than max_error, nothing was left
};

/// One conversion, by a plan that was made of options.plan. `is_retry`: an interrupt leaves no part file behind, which
/// `resume` could not use.
[[nodiscard]] ConversionResult run_conversion(HeightSource& source, const Plan& plan, const std::string& output,
                                              const ConvertOptions& options, const Job& job, bool is_retry = false);

}  // namespace isohf
