#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "isohf/convert.h"
#include "isohf/verify.h"

namespace isohf::cli {

/// What verify --against measures and prints.
struct Accuracy {
  VertexReport vertices;
  AccuracyReport surface;
};

/// Opens the archive; the source is the one that it was made from.
[[nodiscard]] Accuracy measure_accuracy(const std::string& archive, HeightSource& source, const Job& job);

/// "rms 4.7, largest 61 over 1,442,401 samples".
[[nodiscard]] std::string describe_accuracy(const AccuracyInfo& info, const std::string& unit);
[[nodiscard]] nlohmann::ordered_json json_from_estimate(const ErrorEstimate& estimate);
/// Says that it is an estimate, or why there is none.
[[nodiscard]] std::string describe_estimate(const ErrorEstimate& estimate, const std::string& unit);

/// Members as docs/cli.md has them.
[[nodiscard]] nlohmann::ordered_json json_from(const Accuracy& accuracy);
/// A few lines; `input` is the source's name.
[[nodiscard]] std::string text_from(const Accuracy& accuracy, const std::string& input);

}  // namespace isohf::cli
