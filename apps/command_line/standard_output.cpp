#include "standard_output.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "isohf/base/error.h"
#include "program.h"

namespace isohf::cli {
namespace {

constexpr std::size_t kBufferBytes = 1 << 16;

/// Writes a line in one call, so that lines of two processes do not mix; what cannot be told is not told. Line breaks
/// and control characters inside become blanks: an error is one line.
void write_line_to_stderr(std::string line) {
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = ' ';
  }
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
  write_line_to_stderr(program_name() + ": warning: " + text);
}
void print_error(const std::string& text) {
  write_line_to_stderr(program_name() + ": " + text);
}
void print_note(const std::string& text) {
  write_line_to_stderr(text);
}

}  // namespace isohf::cli
