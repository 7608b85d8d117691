#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "isohf/convert/convert.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/raster.h"

namespace isohf {

/// How far a surface will lie from the source's samples, by some of them.
struct ErrorEstimate {
  double rms = 0.0;
  double largest = 0.0;      ///< of those looked at: most often there are larger ones
  std::int64_t samples = 0;  ///< that it stands on
};

/// The error that a conversion by this plan will have, from up to 64 windows of 64 x 64 samples, at most a thirtieth of
/// a large source: resampled and compared on the triangles as the archive will be. Deterministic. nullopt where the
/// source would have to be unpacked as a whole or filled for it, where memory is limited, or where nothing but voids
/// was met.
[[nodiscard]] std::optional<ErrorEstimate> estimate_error(HeightSource& source, const Plan& plan,
                                                          const ConvertOptions& options);

/// Which of a conversion's options --max-error may choose.
struct ErrorFreedom {
  bool density = true;
  bool filter = true;
};

/// Converts so that the surface lies within options.max_error of every sample that it has an elevation for, by
/// options.measure, which sees all of them: no archive that does not gets its name.
///
/// Windows of the source that are held in memory tell the smallest density (and the filter) that holds on them; the
/// archive made with it is measured, and where it fails its worst places become windows, too. So on, up to eight times,
/// to the lattice that runs through all samples, or to density 4 where there is none (projected or joined sources).
/// Throws Error{kInvalidArgument} with the smallest error that was reached, and its density and bytes, where none will
/// do. options.resume continues the first of these conversions only.
ConvertSummary convert_within(HeightSource& source, const std::string& output, const ConvertOptions& options,
                              const ErrorFreedom& freedom, const std::function<void(const ConvertProgress&)>& progress,
                              const std::atomic<bool>& cancel);

}  // namespace isohf
