#pragma once

#include <string>
#include <vector>

#include "isohf/error.h"

namespace isohf {

/// Removes the files that accompany elevations from `paths`: error layers, counts and masks, by the words that products
/// put into their names (docs/formats.md, "Companions of elevations"). Those without elevations beside them stay.
/// Returns a warning of loss that names what was left out, or nothing.
[[nodiscard]] std::vector<Warning> leave_out_companions(std::vector<std::string>& paths);

}  // namespace isohf
