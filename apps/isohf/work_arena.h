#pragma once

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <cstddef>

namespace isohf::cli {

/// The threads that -j asks for, while it lives: also for arenas that the library makes. Without the limit raised
/// first, oneTBB says on standard error that it ignores a request for more threads than there are cores.
class WorkArena {
 public:
  /// threads  0 for one a core
  explicit WorkArena(int threads)
      : threads_(threads > 0 ? threads : oneapi::tbb::this_task_arena::max_concurrency()),
        limit_(oneapi::tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads_)),
        arena_(threads_) {}

  /// Works on those threads.
  template <typename Work>
  auto execute(Work work) {
    return arena_.execute(work);
  }

 private:
  int threads_;
  oneapi::tbb::global_control limit_;
  oneapi::tbb::task_arena arena_;
};

}  // namespace isohf::cli
