// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>

namespace isohf {

/// How far a long run has come.
struct Progress {
  std::string stage;        ///< "range", "tiles", "residuals", "verify", "compare", ...
  std::string unit;         ///< what is counted: "rows", "tiles"
  std::int64_t done = 0;    ///< of the stage, which ends with done == total
  std::int64_t total = 0;   ///< >= 1
  std::uint64_t bytes = 0;  ///< written so far; 0 where nothing is written
};

/// How everything that takes long is run: on how many threads, within how much memory, who hears of it, and who may
/// stop it. No result depends on it.
struct Job {
  int threads = 0;                  ///< 0: one a core
  std::uint64_t memory_bytes = 0;   ///< peak of the resident set, held to within a tenth; 0: a quarter of the machine's
  std::uint64_t machine_bytes = 0;  ///< memory of the machine; 0: not known, and memory_bytes alone bounds a run
  std::string scratch_folder = ".";  ///< where rows go that memory has no room for, in a file without a name
  /// Called by one thread at a time, after every tile or band of rows; not to be waited in.
  std::function<void(const Progress&)> progress = {};
  const std::atomic<bool>* cancel = nullptr;  ///< once true, Error{kCancelled} within a fraction of a second

  void report(const Progress& at) const {
    if (progress) progress(at);
  }
  /// The peak that no run may exceed; 0: none. Below the machine's bound a run takes the fastest way.
  [[nodiscard]] std::uint64_t bound_bytes() const { return memory_bytes != 0 ? memory_bytes : machine_bytes / 4; }
  /// Throws Error{kCancelled}.
  void throw_if_cancelled() const;
};

}  // namespace isohf
