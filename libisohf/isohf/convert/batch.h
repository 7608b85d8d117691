#pragma once

#include <cstddef>
#include <functional>

#include "isohf/convert.h"
#include "isohf/job.h"
#include "isohf/raster.h"

namespace isohf {

/// Independent tasks, as conversions of many files are: small ones side by side on one thread each, large ones alone on
/// all threads.
struct Batch {
  /// What a task may use: a share of the threads and the memory, or all of them.
  struct Share {
    Job job;
    bool is_whole = false;
  };
  enum class Outcome {
    kDone,
    kTooLarge,  ///< for a share: runs again with the whole
    kStop,      ///< done, and no further task is to begin
  };

  std::size_t count = 0;  ///< of tasks, which are numbered from 0
  /// Runs a task, on any thread. It begins with a share if `is_small`.
  std::function<Outcome(std::size_t number, const Share& share)> run;
  std::function<bool(std::size_t number)> is_small;
  /// Called once for each task that has run, in the order of their numbers, by one thread at a time.
  std::function<void(std::size_t number)> report;
};

/// Whether a conversion takes one thread a fraction of a second, and no more memory than the share.
[[nodiscard]] bool fits_share(const HeightSource& source, const ConvertOptions& options, const Job& share);

/// Runs the tasks within the threads and the memory of `job`. An exception of run() or report() ends the batch and is
/// thrown again.
void run_batch(const Batch& batch, const Job& job);

}  // namespace isohf
