#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// The value that a sample of `type` holds when a file or a user writes `value` in decimal: rounded to the type's
/// precision, so that "-3.4e38" finds the float32 voids; nullopt where no sample of that type can hold it.
[[nodiscard]] std::optional<double> void_value_as_stored(SampleType type, double value);

/// The bytes of a sample of `type` that holds `value`, which it can (void_value_as_stored); infinities are NaN in halves.
[[nodiscard]] std::vector<std::byte> stored_sample(SampleType type, double value);

/// Beyond it floats are no ground's, in any unit: voids that a file forgot to declare (-3.4e38, 1.7e308, 1e31).
inline constexpr double kBeyondAnyGround = 1e30;
/// Makes them voids where a raster of floats declares none.
void bound_undeclared_voids(SourceInfo& info);

/// Lets what the user says override what the file says; every reader calls it last and once, on a complete `info`:
/// z_scale and z_offset act on what the file's own make.
///
/// registration replaces only the meaning of the samples: the place of sample (0, 0) stays where the file puts it.
/// void_values replace the list of void values; the valid range of special pixels stays.
/// spacing is in metres: coordinates in metres (feet, kilometres) keep their origin, now in metres; others lose it,
/// with a warning when the file had a unit. Throws Error{kInvalidArgument}: a value that is not finite, a spacing <= 0,
/// a scale of 0, a void value that the sample type cannot hold. `options.channel` is the reader's own business.
void apply_open_options(SourceInfo& info, const OpenOptions& options);

}  // namespace isohf
