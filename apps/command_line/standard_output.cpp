#include "standard_output.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "isohf/base/error.h"
#include "program.h"
#include "terminal.h"

namespace isohf::cli {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;

/// Line breaks and control characters become blanks: an error is one line.
std::string one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
  return text;
}

/// Writes a line in one call, so that lines of two processes do not mix; what cannot be told is not told.
void write_line_to_stderr(std::string line) {
  line += '\n';
  const char* data = line.data();
  std::size_t left = line.size();
  while (left > 0) {
    const ssize_t written = ::write(STDERR_FILENO, data, left);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    data += written;
    left -= static_cast<std::size_t>(written);
  }
}

}  // namespace

void StandardOutput::write(std::string_view text) {
  pending_ += text;
  if (pending_.size() >= kBufferBytes) flush();
}

void StandardOutput::flush() {
  std::size_t from = 0;
  while (from < pending_.size()) {
    const ssize_t written = ::write(STDOUT_FILENO, pending_.data() + from, pending_.size() - from);
    if (written < 0) {
      if (errno == EINTR) continue;
      if (errno == EPIPE) throw OutputClosed{};
      throw Error(ErrorCode::kIo, std::string("standard output: ") + std::strerror(errno));
    }
    from += static_cast<std::size_t>(written);
  }
  pending_.clear();
}

void print_warning(const std::string& text) {
  write_line_to_stderr(program_name() + ": " + styled("warning:", Style::kWarning, STDERR_FILENO) + " " +
                       one_line(text));
}
void print_error(const std::string& text) {
  write_line_to_stderr(styled(program_name() + ":", Style::kError, STDERR_FILENO) + " " + one_line(text));
}
void print_note(const std::string& text) {
  write_line_to_stderr(one_line(text));
}

}  // namespace isohf::cli
