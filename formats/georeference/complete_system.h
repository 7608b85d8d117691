#pragma once

#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Completes what a raster's file says of its reference system by what the user says: a system where it has none, a
/// datum that it leaves unknown, a code, heights. Throws what take_system() throws, and Error{kInvalidArgument} where
/// the two contradict each other.
void complete_system(const std::string& text, SourceInfo& info);

}  // namespace isohf
