#pragma once

#include <memory>

#include "isohf/raster.h"

namespace isohf {

/// A raster of which another one of the same size tells what is transparent: where `opacity` is 0 there is no
/// elevation.
///
/// The samples stay as stored where the raster declares a void value or has floats; integers without one widen to a
/// type that has a number to spare, which the warnings say. Throws Error{kCorrupt}: sizes differ.
[[nodiscard]] std::unique_ptr<HeightSource> mask_transparent(std::unique_ptr<HeightSource> heights,
                                                             std::unique_ptr<HeightSource> opacity);

}  // namespace isohf
