#include "output/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "options/describe.h"
#include "output/json_output.h"
#include "output/standard_output.h"
#include "output/terminal.h"

namespace isohf::cli {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kTerminalInterval{100};
constexpr milliseconds kLineInterval{2000};

void write_text(int file, const std::string& text) {
  // A terminal that has gone away is no reason to stop.
  [[maybe_unused]] const ssize_t written = ::write(file, text.data(), text.size());
}

}  // namespace

ProgressDisplay::ProgressDisplay(const Common& common, ProgressMode mode) : common_(common), mode_(mode) {
  if (mode == ProgressMode::kAuto && terminal_columns(common.err) == 0)
    mode_ = common.verbose ? ProgressMode::kPlain : ProgressMode::kNone;
  if (common.quiet) mode_ = ProgressMode::kNone;
}

ProgressDisplay::~ProgressDisplay() {
  clear();
}

void ProgressDisplay::clear() {
  if (is_shown_) write_text(common_.err, "\r\x1b[K");
  is_shown_ = false;
}

void ProgressDisplay::update(const std::string& what, const std::string& unit, std::int64_t done, std::int64_t total) {
  if (mode_ == ProgressMode::kNone) return;
  const Clock::time_point now = Clock::now();
  const bool is_new = what != what_;
  const bool is_last = done >= total;
  if (is_new) {
    what_ = what;
    started_ = now;
    first_done_ = done;
  }
  const milliseconds interval = mode_ == ProgressMode::kPlain ? kLineInterval : kTerminalInterval;
  if (!is_new && !is_last && now - shown_ < interval) return;
  shown_ = now;
  const double seconds = std::chrono::duration<double>(now - started_).count();
  const double rate = seconds > 0.0 ? static_cast<double>(done - first_done_) / seconds : 0.0;
  const double left = rate > 0.0 ? static_cast<double>(total - done) / rate : 0.0;
  const double part = total > 0 ? std::clamp(static_cast<double>(done) / static_cast<double>(total), 0.0, 1.0) : 1.0;
  if (mode_ == ProgressMode::kJson) {
    const auto rounded = [](double value) { return std::round(1000.0 * value) / 1000.0; };
    write_text(common_.err, json_line({{"progress", what},
                                       {"unit", unit},
                                       {"done", done},
                                       {"total", total},
                                       {"seconds", rounded(seconds)},
                                       {"seconds_left", rounded(left)}}));
    return;
  }
  std::string text = fmt::format("{} {:3.0f} %  {}/{} {}", what, 100.0 * part, done, total, unit);
  if (rate > 0.0) text += fmt::format("  {:.4g} {}/s", rate, unit);
  if (rate > 0.0 && !is_last) text += fmt::format("  {} left", describe_seconds(left));
  if (mode_ == ProgressMode::kPlain) {
    print_note(common_, text);
    return;
  }
  // A line that is wider than the terminal cannot be overwritten.
  text.resize(std::min(text.size(), std::max<std::size_t>(terminal_columns(common_.err), 1) - 1));
  write_text(common_.err, "\r" + text + "\x1b[K");
  is_shown_ = true;
}

}  // namespace isohf::cli
