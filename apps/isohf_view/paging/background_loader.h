#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <iterator>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace isohf::view {

/// Worker threads that answer requests in the background, first come, first served. Only the thread that owns the
/// loader calls it; no call waits for a worker.
template <typename Request, typename Answer>
class BackgroundLoader {
 public:
  /// load  runs on the workers, several at once, and must not throw      workers >= 1
  BackgroundLoader(std::function<Answer(const Request&)> load, int workers) : load_(std::move(load)) {
    for (int i = 0; i < workers; ++i) {
      workers_.emplace_back([this](const std::stop_token& stop) { work(stop); });
    }
  }
  ~BackgroundLoader() {
    for (std::jthread& worker : workers_) worker.request_stop();
  }
  BackgroundLoader(const BackgroundLoader&) = delete;
  BackgroundLoader& operator=(const BackgroundLoader&) = delete;

  void request(const Request& request) {
    {
      const std::lock_guard lock(mutex_);
      wanted_.push_back(request);
    }
    ++in_flight_;
    wake_.notify_one();
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
  void work(const std::stop_token& stop) {
    for (;;) {
      Request request;
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, stop, [this] { return !wanted_.empty(); });
        if (stop.stop_requested()) return;
        request = wanted_.front();
        wanted_.pop_front();
      }
      Answer answer = load_(request);
      const std::lock_guard lock(mutex_);
      ready_.push_back(std::move(answer));
    }
  }

  std::function<Answer(const Request&)> load_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<Request> wanted_;
  std::vector<Answer> ready_;
  std::size_t in_flight_ = 0;
  std::vector<std::jthread> workers_;  // last: they stop first
};

}  // namespace isohf::view
