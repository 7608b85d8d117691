#pragma once

#include <functional>
#include <memory>

#include "isohf/job.h"

namespace isohf {

/// Threads of a job, one a core where it asks for none.
[[nodiscard]] int threads_of(const Job& job);

/// As many of `wanted` threads as the system lets this process have beside each other, the caller's own among them:
/// oneTBB ends the program where it cannot start one that it was allowed.
[[nodiscard]] int possible_threads(int wanted);

/// The threads of a job, while it lives: fewer where the system allows no more.
class Arena {
 public:
  explicit Arena(const Job& job);
  ~Arena();

  /// Works on those threads.
  void execute(const std::function<void()>& work);

 private:
  struct Threads;
  std::unique_ptr<Threads> threads_;
};

}  // namespace isohf
