#include "isohf/base/arena.h"

#include <fmt/format.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <deque>
#include <exception>
#include <limits>
#include <mutex>
#include <semaphore>
#include <thread>
#include <vector>

#include "isohf/base/handed_in.h"
#include "isohf/error.h"

namespace isohf {

using oneapi::tbb::global_control;

int threads_of(const Job& job) {
  constexpr int kMostThreads = 1024;
  if (job.threads < 0 || job.threads > kMostThreads) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("`threads` is {}, must be 1 to {}, or 0 for one a core", job.threads, kMostThreads));
  }
  return job.threads > 0 ? job.threads : oneapi::tbb::this_task_arena::max_concurrency();
}

int possible_threads(int wanted) {
  // Once there were too few, it stays at that: arenas lie within each other, and oneTBB complains on standard error of
  // one that wants more than the outer one may have.
  static std::atomic<int> known = 1;
  static std::atomic<int> most = std::numeric_limits<int>::max();
  wanted = std::min<int>(wanted, most);
  if (wanted <= known) return wanted;
  std::counting_semaphore<> end(0);
  std::vector<std::thread> others;
  try {
    others.reserve(static_cast<std::size_t>(wanted));
    while (static_cast<int>(others.size()) + 1 < wanted) others.emplace_back([&] { end.acquire(); });
  } catch (const std::exception&) {
    // The system has no more threads, or no memory for one: then fewer. Those that run must be joined.
  }
  const int possible = static_cast<int>(others.size()) + 1;
  end.release(possible);
  for (std::thread& other : others) other.join();
  (possible == wanted ? known : most) = possible;
  return possible;
}

/// Has oneTBB start its workers while nothing is at stake: where it cannot start one it throws from whatever call wanted
/// it, past the tasks that another worker has begun. Workers stay for as long as the process, so once is enough.
void start_workers(oneapi::tbb::task_arena& arena, int workers) {
  static std::atomic<int> started = 0;
  if (workers <= started) return;
  struct Gate {
    std::atomic<int> arrived = 0;
    std::atomic<bool> is_open = false;
  };
  // Tasks outlive this call where one of them throws, or where a worker comes late; some never run. So gates stay, one
  // for each number of workers that is more than any before.
  static std::mutex making;
  static auto* const gates = new std::deque<Gate>;  // NOLINT(cppcoreguidelines-owning-memory)
  Gate* const gate = [] {
    const std::lock_guard lock(making);
    return &gates->emplace_back();
  }();
  const auto open = [gate] {
    gate->is_open = true;
    gate->is_open.notify_all();
  };
  try {
    for (int i = 0; i < workers; ++i) {
      arena.enqueue([gate] {
        ++gate->arrived;
        gate->is_open.wait(false);
      });
    }
  } catch (...) {
    open();
    throw;
  }
  // A program around this one may allow fewer workers, which then never arrive.
  constexpr auto kLongest = std::chrono::milliseconds(50);
  const auto end = std::chrono::steady_clock::now() + kLongest;
  while (gate->arrived < workers && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  open();
  started = workers;
}

/// Without the limit raised first, oneTBB says on standard error that it ignores a request for more threads than there
/// are cores.
struct Arena::Threads {
  explicit Threads(int threads)
      : limit(global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)), arena(threads) {
    start_workers(arena, threads - 1);
  }

  global_control limit;
  oneapi::tbb::task_arena arena;
};

Arena::Arena(const Job& job) : threads_(std::make_unique<Threads>(possible_threads(threads_of(job)))) {}
Arena::~Arena() = default;

void Arena::execute(const std::function<void()>& work) {
  // What takes long runs here: memory that there is not is told as anything else that goes wrong.
  or_out_of_memory({}, [&] { threads_->arena.execute(work); });
}

}  // namespace isohf
