#pragma once

#include <optional>
#include <type_traits>
#include <utility>

#include "isohf/base/arena.h"

namespace isohf::cli {

/// The threads that -j asks for, while it lives: also for arenas that the library makes.
class WorkArena {
 public:
  /// threads  0 for one a core
  explicit WorkArena(int threads) : arena_(job_of(threads)) {}

  /// Works on those threads.
  template <typename Work>
  auto execute(Work work) {
    if constexpr (std::is_void_v<decltype(work())>) {
      arena_.execute(work);
    } else {
      std::optional<decltype(work())> result;
      arena_.execute([&] { result.emplace(work()); });
      return std::move(*result);
    }
  }

 private:
  static Job job_of(int threads) {
    Job job;
    job.threads = threads;
    return job;
  }

  Arena arena_;
};

}  // namespace isohf::cli
