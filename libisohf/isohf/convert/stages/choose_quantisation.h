#pragma once

#include <optional>

#include "isohf/archive/tile/quantise.h"
#include "isohf/metadata.h"
#include "isohf/raster.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {

/// How codes are to be chosen.
struct QuantisationRequest {
  CodeType type = CodeType::kU16;
  std::optional<double> step;  ///< elevation of one code; 0: the finest that the type holds; nullopt: chosen
  std::optional<double> max_rounding = {};  ///< half a step and height_error are at most that; alone: as near as can be
  double height_error = 0.0;                ///< how far heights are off before they are rounded
  std::optional<double> wish = {};          ///< where neither is given: a step of about that, or as fine as can be
};

/// One scale and offset for the whole dataset.
///
/// The chosen step is half of the source's own for integer samples, or that where the range needs it, and the finest
/// that fits for floats and for wider ranges. But for the finest the offset is a multiple of the step, so that whole
/// elevations stay whole.
/// Throws Error{kInvalidArgument} where a step that was asked for needs more codes than the type has, naming the
/// smallest one that fits.
[[nodiscard]] Quantisation choose_quantisation(const QuantisationRequest& request, const ElevationRange& range,
                                               const SourceInfo& info);

/// The same where the first code is to be range.min and another one range.max, so that nothing stored lies beyond and
/// everything between them is stored to within half a step. A step that was asked for must divide the range, or it is
/// refused with those that do; one that is chosen, or given by max_rounding, becomes so much finer that it does.
[[nodiscard]] Quantisation quantisation_of_range(const QuantisationRequest& request, const ElevationRange& range,
                                                 const SourceInfo& info);

/// True where steps of this scale reach over the whole range with the codes that the type has.
[[nodiscard]] bool has_codes_for(const Quantisation& quantisation, const ElevationRange& range);

/// The most by which a reconstruction can leave the range of its samples: every value of a surface made of samples in
/// [a, b] lies in [a - m(b-a), b + m(b-a)], where m is returned. 0 for kernels that stay within the range of the
/// samples around, by their weights or by their limits. Holds for rasters without voids that are larger than the
/// prefilter's halo and the kernel along both axes.
///
/// m = (L^2 - 1)/2 with L the Lebesgue constant of the kernel with its prefilter.
[[nodiscard]] double overshoot(const Kernel& kernel, const Prefilter& prefilter);

/// `range` widened by `fraction` of its length at both ends.
[[nodiscard]] ElevationRange widened(const ElevationRange& range, double fraction);

}  // namespace isohf
