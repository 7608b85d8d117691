#pragma once

#include <functional>
#include <memory>

#include "isohf/job.h"

namespace isohf {

/// Threads of a job, one a core where it asks for none.
[[nodiscard]] int threads_of(const Job& job);

/// The threads of a job, while it lives.
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
