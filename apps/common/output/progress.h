#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "common.h"

namespace isohf::cli {

/// In the order of --progress's words.
enum class ProgressMode { kAuto, kPlain, kJson, kNone };

/// How far a long run has come, on standard error: one line with rate and time left on a terminal, plain lines or JSON
/// lines otherwise. Erases its line on a terminal when it goes.
class ProgressDisplay {
 public:
  /// -q silences it; kAuto is one line on a terminal, plain lines with -v, else nothing.
  ProgressDisplay(const Common& common, ProgressMode mode);
  ~ProgressDisplay();
  ProgressDisplay(const ProgressDisplay&) = delete;
  ProgressDisplay& operator=(const ProgressDisplay&) = delete;

  /// `what` names the pass ("tiles"); a new name starts a new clock. `unit` is what is counted.
  void update(const std::string& what, const std::string& unit, std::int64_t done, std::int64_t total);
  /// Erases the line on a terminal, for one that is printed now.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  const Common& common_;
  ProgressMode mode_;  ///< kAuto: on a terminal
  std::string what_;
  Clock::time_point started_;
  Clock::time_point shown_;
  std::int64_t first_done_ = 0;
  bool is_shown_ = false;
};

}  // namespace isohf::cli
