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

/// "elevations take 1.2 MB, 3.1 bits a source sample: 5.1 times smaller than the source's 6.3 MB of int16".
[[nodiscard]] std::string describe_size(const Metadata& metadata, std::uint64_t tile_bytes);

}  // namespace isohf::cli
