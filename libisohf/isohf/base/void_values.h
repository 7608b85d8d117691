#pragma once

#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// "`void_values` A,B,C": what makes these values voids besides those that the source declares.
[[nodiscard]] std::string void_values_with(const SourceInfo& info, std::vector<double> values);

}  // namespace isohf
