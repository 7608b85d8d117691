#pragma once

#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// The shortest decimal number that a sample of that type holds as `value`.
[[nodiscard]] std::string shortest_text(SampleType type, double value);

/// "`void_values` A,B,C": what makes these values voids besides those that the source declares.
[[nodiscard]] std::string void_values_with(const SourceInfo& info, std::vector<double> values);

}  // namespace isohf
