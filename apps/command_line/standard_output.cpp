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

std::string printable(std::string text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto at = [&](std::size_t k) { return k < text.size() ? static_cast<unsigned char>(text[k]) : 0U; };
    const bool is_c0 = at(i) < 0x20 || at(i) == 0x7f;
    // In UTF-8: U+0080 to U+009F, and what turns the direction of writing or breaks a line.
    const bool is_c1 = at(i) == 0xc2 && at(i + 1) >= 0x80 && at(i + 1) < 0xa0;
    const bool is_format = at(i) == 0xe2 && ((at(i + 1) == 0x80 && at(i + 2) >= 0xa8 && at(i + 2) <= 0xae) ||
                                             (at(i + 1) == 0x81 && at(i + 2) >= 0xa6 && at(i + 2) <= 0xa9));
    if (is_c0) text[i] = ' ';
    if (is_c1) text.replace(i, 2, " ");
    if (is_format) text.replace(i, 3, " ");
  }
  return text;
}

void print_warning(const std::string& text) {
  write_line_to_stderr(program_name() + ": " + styled("warning:", Style::kWarning, STDERR_FILENO) + " " +
                       printable(text));
}
void print_error(const std::string& text) {
  write_line_to_stderr(styled(program_name() + ":", Style::kError, STDERR_FILENO) + " " + printable(text));
}
void print_note(const std::string& text) {
  write_line_to_stderr(printable(text));
}

}  // namespace isohf::cli
