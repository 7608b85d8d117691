#pragma once

#include <cstddef>

#include "isohf/raster.h"

namespace isohf {

using LoadSample = double (*)(const std::byte* at);
using StoreSample = void (*)(double raw, std::byte* at);

/// Reads one raw sample of the type; half-precision ones as numbers, exactly.
[[nodiscard]] LoadSample load_sample(SampleType type);
/// Writes one. `raw` must be a number that the type holds (nearest_sample).
[[nodiscard]] StoreSample store_sample(SampleType type);

/// The number nearest to `raw` that the type holds; its largest or smallest beyond these. Ties go up for integers, to
/// even for floats. `raw` is no NaN.
[[nodiscard]] double nearest_sample(SampleType type, double raw);
/// The next larger and the next smaller number that the type holds; the same where there is none. `raw` is held.
[[nodiscard]] double next_sample(SampleType type, double raw);
[[nodiscard]] double previous_sample(SampleType type, double raw);

}  // namespace isohf
