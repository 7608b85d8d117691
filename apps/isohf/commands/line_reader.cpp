#include "commands/line_reader.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "isohf/error.h"

namespace isohf::cli {
namespace {

constexpr std::size_t kReadBytes = 1 << 16;
constexpr std::size_t kLongestLine = 1 << 20;

}  // namespace

std::optional<std::string> LineReader::take_line() {
  const std::size_t end = buffer_.find('\n', from_);
  if (end == std::string::npos) {
    if (!at_end_ || from_ == buffer_.size()) return std::nullopt;
    std::string line = buffer_.substr(from_);  // the last line needs no line end
    from_ = buffer_.size();
    ++line_number_;
    return line;
  }
  std::string line = buffer_.substr(from_, end - from_);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  from_ = end + 1;
  ++line_number_;
  return line;
}

bool LineReader::would_wait() const {
  struct pollfd input {
    file_, POLLIN, 0
  };
  return ::poll(&input, 1, 0) == 0;
}

void LineReader::read_more() {
  buffer_.erase(0, from_);
  from_ = 0;
  if (buffer_.size() > kLongestLine) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("standard input: line {} is longer than {} bytes", line_number_ + 1, kLongestLine));
  }
  const std::size_t old_size = buffer_.size();
  buffer_.resize(old_size + kReadBytes);
  ssize_t got = 0;
  do {
    got = ::read(file_, buffer_.data() + old_size, kReadBytes);
  } while (got < 0 && errno == EINTR);
  if (got < 0) throw Error(ErrorCode::kIo, std::string("standard input: ") + std::strerror(errno));
  buffer_.resize(old_size + static_cast<std::size_t>(got));
  at_end_ = got == 0;
}

}  // namespace isohf::cli
