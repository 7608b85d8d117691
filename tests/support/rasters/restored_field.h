#pragma once

#include "isohf/surface.h"
#include "support/rasters/trigonometric_field.h"

namespace isohf::test {

/// PSNR in dB, relative to the samples' peak-to-peak range, of the field's samples after isohf's own conversion to an
/// archive and restoring from it: floats, 5 x 6 small tiles, column step 1 and row step 26/30 = 0.8667 (sqrt(3)/2 =
/// 0.8660), 15.4 % more vertices than samples. Only samples at least `margin` from the square's edge count.
[[nodiscard]] double psnr_of_restoring(Filter filter, const TrigonometricField& field, int margin,
                                       RestoreMethod method);

}  // namespace isohf::test
