#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "isohf/metadata.h"

namespace isohf {

/// How far an archive's surface, as it is drawn, lies from the samples of its source: the metadata's member "accuracy",
/// which is there where the writer measured it.
struct AccuracyInfo {
  std::int64_t compared = 0;  ///< samples with elevations on both sides
  std::int64_t lost = 0;      ///< elevations of the source in voids of the surface: beside voids
  double rms = 0.0;           ///< vertical units
  double max = 0.0;
  std::optional<double> max_error;  ///< that was asked for; max is at most that
  double rounding = 0.0;            ///< the bound on a stored vertex's: half a step; of f32 the largest there was
};

inline constexpr const char* kAccuracyName = "accuracy";  ///< of the metadata's extension

class JsonMembers;
void accuracy_members(JsonMembers& json, AccuracyInfo& info);

/// The extension's JSON.
[[nodiscard]] std::string format_accuracy_info(const AccuracyInfo& info);
/// The record of an archive's metadata; nullopt where it was not measured. Throws Error{kCorrupt} naming the member at
/// fault, and where the figures contradict each other or the source's size.
[[nodiscard]] std::optional<AccuracyInfo> accuracy_info(const Metadata& metadata);

}  // namespace isohf
