#pragma once

#include <cmath>
#include <memory>

#include "isohf/archive/tile/quantise.h"
#include "isohf/convert.h"
#include "isohf/convert/memory_plan.h"
#include "isohf/convert/stages/choose_quantisation.h"
#include "isohf/sampling/resample/kernels.h"
#include "isohf/sampling/resample/prefilter.h"
#include "isohf/sampling/resample/tile_resampler.h"
#include "isohf/sampling/source/source_statistics.h"

namespace isohf {

/// What one conversion holds constant once choose_codes() is done.
struct Conversion {
  HeightSource& source;
  const ConvertOptions& options;
  const Plan& plan;
  const MemoryPlan& memory;
  const Kernel kernel;
  const Prefilter prefilter;
  const Job& job;
  double datum = 0.0;
  double height_error = 0.0;  ///< of heights above it
  Quantisation quantisation{};
  double largest = 0.0;         ///< no elevation is meant to lie further from 0
  ElevationRange range{};       ///< that the codes reach over
  CodeLimits limits{};          ///< of what is stored; the ends of options.z_range where it is given
  std::int64_t first_tile = 0;  ///< flat index; of a shard
  std::int64_t end_tile = plan.grid.tile_count();

  /// How far a code may lie from what was computed, where that is more than half of a step that was asked for; else 0.
  [[nodiscard]] double most_off() const { return chooses_codes(options) ? *options.max_rounding - height_error : 0.0; }
  [[nodiscard]] SourceGeometry geometry() const { return plan.frame.geometry(); }
  /// Elevations beyond the source's edge are held within a range.
  [[nodiscard]] std::unique_ptr<TileResampler> cutter(const ElevationRange& held_within) const {
    return make_tile_resampler(plan.grid, geometry(), kernel, held_within);
  }
};

/// How the options ask for codes, of heights that are off by height_error.
[[nodiscard]] QuantisationRequest quantisation_request(const SourceInfo& info, const ConvertOptions& options,
                                                       double height_error);

/// The first pass over the source, where one is needed, and what follows from it: datum, scale and offset.
void choose_codes(Conversion& conversion, ConvertSummary& summary);

}  // namespace isohf
