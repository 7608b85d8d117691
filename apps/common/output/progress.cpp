#include "output/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "options/describe.h"
#include "output/standard_output.h"
#include "output/terminal.h"

namespace isohf::cli {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kBarInterval{100};
constexpr milliseconds kLineInterval{2000};
constexpr std::size_t kBarCells = 24;

void write_to_terminal(int file, const std::string& text) {
  // A terminal that has gone away is no reason to stop.
  [[maybe_unused]] const ssize_t written = ::write(file, text.data(), text.size());
}

}  // namespace

ProgressDisplay::ProgressDisplay(const Common& common, ProgressMode mode) : common_(common), style_(Style::kNothing) {
  if (common.quiet || mode == ProgressMode::kNone) return;
  if (mode == ProgressMode::kJson) style_ = Style::kJson;
  if (mode == ProgressMode::kPlain) style_ = Style::kLines;
  if (mode == ProgressMode::kAuto) {
    style_ = terminal_columns(common.err) > 0 ? Style::kBar : common.verbose ? Style::kLines : Style::kNothing;
  }
}

ProgressDisplay::~ProgressDisplay() {
  clear();
}

void ProgressDisplay::clear() {
  if (bar_is_shown_) write_to_terminal(common_.err, "\r\x1b[K");
  bar_is_shown_ = false;
}

void ProgressDisplay::update(const std::string& what, const std::string& unit, std::int64_t done, std::int64_t total) {
  if (style_ == Style::kNothing) return;
  const Clock::time_point now = Clock::now();
  const bool is_new = what != what_;
  const bool is_last = done >= total;
  if (is_new) {
    what_ = what;
    started_ = now;
    first_done_ = done;
  }
  const milliseconds interval = style_ == Style::kLines ? kLineInterval : kBarInterval;
  if (!is_new && !is_last && now - shown_ < interval) return;
  shown_ = now;
  const double seconds = std::chrono::duration<double>(now - started_).count();
  const double rate = seconds > 0.0 ? static_cast<double>(done - first_done_) / seconds : 0.0;
  const double left = rate > 0.0 ? static_cast<double>(total - done) / rate : 0.0;
  const double part = total > 0 ? std::clamp(static_cast<double>(done) / static_cast<double>(total), 0.0, 1.0) : 1.0;
  if (style_ == Style::kJson) {
    print_progress(
        common_,
        fmt::format(R"({{"progress":"{}","unit":"{}","done":{},"total":{},"seconds":{:.3f},"seconds_left":{:.3f}}})",
                    what, unit, done, total, seconds, left));
    return;
  }
  std::string text = fmt::format("{} {:3.0f} %  {}/{} {}", what, 100.0 * part, done, total, unit);
  if (rate > 0.0) text += fmt::format("  {:.4g} {}/s", rate, unit);
  if (rate > 0.0 && !is_last) text += fmt::format("  {} left", describe_seconds(left));
  if (style_ == Style::kLines) {
    print_note(common_, text);
    return;
  }
  // A line that is wider than the terminal cannot be overwritten. The bar gives way before the figures do.
  const std::size_t columns = terminal_columns(common_.err);
  const std::size_t room = columns > text.size() + 4 ? std::min(columns - text.size() - 4, kBarCells) : 0;
  const auto cells = static_cast<std::size_t>(part * static_cast<double>(room));
  if (columns > 0) text.resize(std::min(text.size(), columns - 1));
  const std::string bar =
      room == 0 ? "" : fmt::format("[{}{}] ", std::string(cells, '#'), std::string(room - cells, '.'));
  write_to_terminal(common_.err, fmt::format("\r{}{}\x1b[K", bar, text));
  bar_is_shown_ = true;
}

}  // namespace isohf::cli
