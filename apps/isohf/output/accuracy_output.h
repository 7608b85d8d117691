#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "isohf/convert.h"

namespace isohf::cli {

/// "rms 4.7 m, largest 61 m over 1 442 401 input samples".
[[nodiscard]] std::string describe_accuracy(const AccuracyInfo& info, const std::string& unit);
[[nodiscard]] nlohmann::ordered_json json_from_estimate(const ErrorEstimate& estimate);
/// Says that it is an estimate, or why there is none.
[[nodiscard]] std::string describe_estimate(const ErrorEstimate& estimate, const std::string& unit);

}  // namespace isohf::cli
