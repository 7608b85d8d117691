#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <iterator>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace isohf::view {

/// The threads that work in the background, for all loaders together; first come, first served.
class Workers {
 public:
  /// threads >= 1
  explicit Workers(int threads) {
    for (int i = 0; i < threads; ++i) {
      threads_.emplace_back([this](const std::stop_token& stop) { work(stop); });
    }
  }
  ~Workers() {
    for (std::jthread& thread : threads_) thread.request_stop();
  }
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// task  must not throw
  void add(std::function<void()> task) {
    {
      const std::lock_guard lock(mutex_);
      tasks_.push_back(std::move(task));
    }
    wake_.notify_one();
  }
  [[nodiscard]] std::size_t count() const { return threads_.size(); }

 private:
  void work(const std::stop_token& stop) {
    for (;;) {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, stop, [this] { return !tasks_.empty(); });
      if (stop.stop_requested()) return;
      const std::function<void()> task = std::move(tasks_.front());
      tasks_.pop_front();
      lock.unlock();
      task();
    }
  }

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::function<void()>> tasks_;
  std::vector<std::jthread> threads_;  // last: they stop first
};

/// Updates what workers load for until it is complete. In between they have a millisecond, and poll() is called, which
/// may throw.
/// update  returns whether nothing is to come
inline void update_until_complete(const std::function<bool()>& update, const std::function<void()>& poll) {
  while (!update()) {
    poll();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// Answers requests by workers, which outlive it. Only the thread that owns the loader calls it; no call waits for a
/// worker, but its end for those that are at work.
template <typename Request, typename Answer>
class BackgroundLoader {
 public:
  /// load  runs on the workers, several at once, and must not throw
  BackgroundLoader(std::function<Answer(const Request&)> load, Workers& workers)
      : load_(std::move(load)), workers_(workers) {}
  ~BackgroundLoader() {
    std::unique_lock lock(mutex_);
    stops_ = true;
    idle_.wait(lock, [this] { return tasks_ == 0; });
  }
  BackgroundLoader(const BackgroundLoader&) = delete;
  BackgroundLoader& operator=(const BackgroundLoader&) = delete;

  void request(const Request& request) {
    {
      const std::lock_guard lock(mutex_);
      ++tasks_;
    }
    ++in_flight_;
    workers_.add([this, request] { work(request); });
  }
  /// Moves what is ready to the end of `out`.
  void collect(std::deque<Answer>& out) {
    const std::lock_guard lock(mutex_);
    in_flight_ -= ready_.size();
    std::move(ready_.begin(), ready_.end(), std::back_inserter(out));
    ready_.clear();
  }
  /// Requests whose answers have not been collected.
  [[nodiscard]] std::size_t in_flight() const { return in_flight_; }

 private:
  void work(const Request& request) {
    std::unique_lock lock(mutex_);
    if (!stops_) {
      lock.unlock();
      Answer answer = load_(request);
      lock.lock();
      ready_.push_back(std::move(answer));
    }
    --tasks_;
    idle_.notify_all();
  }

  std::function<Answer(const Request&)> load_;
  Workers& workers_;
  std::mutex mutex_;
  std::condition_variable idle_;
  std::vector<Answer> ready_;
  std::size_t tasks_ = 0;  ///< that workers have, or will have
  std::size_t in_flight_ = 0;
  bool stops_ = false;
};

}  // namespace isohf::view
