#include "isohf/convert/batch.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <shared_mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "isohf/base/arena.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/convert/memory_plan.h"

namespace isohf {
namespace {

/// A share is at least that large; fewer tasks run side by side if memory is short.
constexpr std::uint64_t kLeastShareBytes = 48'000'000;

/// The state of one run of a batch.
class BatchRun {
 public:
  BatchRun(const Batch& batch, const Job& job) : batch_(batch), ended_(batch.count), whole_{job, true} {
    whole_.job.threads = threads_of(job);
    workers_ = std::min(static_cast<std::size_t>(whole_.job.threads), std::max<std::size_t>(batch.count, 1));
    if (const std::uint64_t bound = job.bound_bytes(); bound != 0)
      workers_ = std::clamp<std::size_t>(bound / kLeastShareBytes, 1, workers_);
    share_.job = job;
    share_.job.threads = 1;
    share_.job.memory_bytes /= workers_;
    share_.job.machine_bytes /= workers_;
  }

  void run() {
    std::vector<std::thread> others;
    others.reserve(workers_);
    try {
      for (std::size_t i = 1; i < workers_; ++i) others.emplace_back([&] { work(); });
    } catch (const std::system_error&) {
      // The system starts no more threads; those that run do all tasks.
    }
    work();
    for (std::thread& other : others) other.join();
    if (fault_) std::rethrow_exception(fault_);
  }

 private:
  void work() {
    for (std::size_t number = 0; next(number);) {
      try {
        end(number, run_task(number));
      } catch (...) {
        const std::lock_guard lock(mutex_);
        if (!fault_) fault_ = std::current_exception();
      }
    }
  }

  bool next(std::size_t& number) {
    const std::lock_guard lock(mutex_);
    if (is_stopped_ || fault_ || begun_ == batch_.count) return false;
    number = begun_++;
    return true;
  }

  Batch::Outcome run_task(std::size_t number) {
    if (batch_.is_small(number)) {
      { const std::lock_guard queue(queue_); }
      const std::shared_lock beside(room_);
      const Batch::Outcome outcome = batch_.run(number, share_);
      if (outcome != Batch::Outcome::kTooLarge) return outcome;
    }
    // Small tasks wait in the queue, so that a large one waits only for those that run.
    const std::lock_guard queue(queue_);
    const std::unique_lock alone(room_);
    return batch_.run(number, whole_);
  }

  void end(std::size_t number, Batch::Outcome outcome) {
    const std::lock_guard lock(mutex_);
    is_stopped_ = is_stopped_ || outcome == Batch::Outcome::kStop;
    ended_[number] = true;
    for (; !fault_ && reported_ < begun_ && ended_[reported_]; ++reported_) batch_.report(reported_);
  }

  const Batch& batch_;
  std::vector<bool> ended_;
  Batch::Share share_;
  Batch::Share whole_;
  std::size_t workers_ = 1;
  std::mutex queue_;
  std::shared_mutex room_;
  std::mutex mutex_;  ///< of what follows
  std::size_t begun_ = 0;
  std::size_t reported_ = 0;
  bool is_stopped_ = false;
  std::exception_ptr fault_;
};

}  // namespace

bool fits_share(const HeightSource& source, const ConvertOptions& options, const Job& share) {
  constexpr std::int64_t kSmallSamples = std::int64_t{1} << 24U;
  const SourceInfo& info = source.info();
  if (info.width > kSmallSamples / info.height) return false;
  const MemoryPlan memory = plan_memory(source, make_plan(info, options.plan), options, share);
  return share.bound_bytes() == 0 || memory.bytes <= share.bound_bytes();
}

void run_batch(const Batch& batch, const Job& job) {
  BatchRun(batch, job).run();
}

}  // namespace isohf
