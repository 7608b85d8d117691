#include "isohf/base/arena.h"

#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <cstddef>

namespace isohf {

using oneapi::tbb::global_control;

int threads_of(const Job& job) {
  return job.threads > 0 ? job.threads : oneapi::tbb::this_task_arena::max_concurrency();
}

/// Without the limit raised first, oneTBB says on standard error that it ignores a request for more threads than there
/// are cores.
struct Arena::Threads {
  explicit Threads(int threads)
      : limit(global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)), arena(threads) {}

  global_control limit;
  oneapi::tbb::task_arena arena;
};

Arena::Arena(const Job& job) : threads_(std::make_unique<Threads>(threads_of(job))) {}
Arena::~Arena() = default;

void Arena::execute(const std::function<void()>& work) {
  threads_->arena.execute(work);
}

}  // namespace isohf
