#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "isohf/archive/codec/quantise.h"
#include "isohf/convert/convert.h"
#include "isohf/convert/memory_plan.h"
#include "isohf/surface/resample/kernels.h"
#include "isohf/surface/resample/prefilter.h"
#include "isohf/surface/resample/tile_resampler.h"

namespace isohf {

using ProgressCallback = std::function<void(const ConvertProgress&)>;

/// Calls back at most ten times a second, and at the end of a pass.
class ProgressMeter {
 public:
  ProgressMeter(const ProgressCallback& callback, ConvertProgress::Pass pass, std::int64_t total)
      : callback_(callback) {
    progress_.pass = pass;
    progress_.total = total;
  }

  void report(std::int64_t done, std::uint64_t bytes_written) {
    if (!callback_) return;
    const auto now = std::chrono::steady_clock::now();
    if (done < progress_.total && now - last_ < std::chrono::milliseconds(100)) return;
    last_ = now;
    progress_.done = done;
    progress_.bytes_written = bytes_written;
    callback_(progress_);
  }

 private:
  const ProgressCallback& callback_;
  ConvertProgress progress_;
  std::chrono::steady_clock::time_point last_{};
};

/// Throws Error{kCancelled}.
void throw_if_cancelled(const std::atomic<bool>& cancel);

/// What one conversion holds constant once choose_codes() is done.
struct Conversion {
  HeightSource& source;
  const ConvertOptions& options;
  const Plan& plan;
  const MemoryPlan& memory;
  const Kernel kernel;
  const Prefilter prefilter;
  const std::atomic<bool>& cancel;
  double datum = 0.0;
  Quantisation quantisation{};
  CodeLimits limits{};  ///< of what is stored; the ends of options.z_range where it is given

  [[nodiscard]] SourceGeometry geometry() const { return plan.frame.geometry(plan.outside); }
  /// Elevations beyond the source's edge are held within a range.
  [[nodiscard]] std::unique_ptr<TileResampler> cutter(const ElevationRange& held_within) const {
    return make_tile_resampler(plan.grid, geometry(), kernel, held_within);
  }
};

/// The first pass over the source, where one is needed, and what follows from it: datum, scale and offset.
void choose_codes(Conversion& job, ConvertSummary& summary, const ProgressCallback& progress);

}  // namespace isohf
