#pragma once

#include <string>

#include "isohf/metadata.h"

namespace isohf {

inline constexpr const char* kAccuracyName = "accuracy";  ///< of the metadata's extension

class JsonMembers;
void accuracy_members(JsonMembers& json, AccuracyInfo& info);

/// The extension's JSON.
[[nodiscard]] std::string format_accuracy_info(const AccuracyInfo& info);

}  // namespace isohf
