#include "support/run_program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <stdexcept>

namespace isohf::test {
namespace {

[[noreturn]] void give_up(const char* what) {
  throw std::runtime_error(std::string(what) + ": " + std::strerror(errno));
}

struct Pipe {
  int read_end = -1;
  int write_end = -1;

  Pipe() {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC) != 0) give_up("pipe");
    read_end = ends[0];
    write_end = ends[1];
  }
};

void limit(int resource, std::uint64_t bytes) {
  const struct rlimit value { bytes, bytes };
  ::setrlimit(static_cast<__rlimit_resource>(resource), &value);
}

/// In the child: everything after fork() up to the new program.
[[noreturn]] void become(const std::vector<std::string>& command, const RunOptions& options, int in, int out, int err) {
  ::dup2(in, STDIN_FILENO);
  ::dup2(err, STDERR_FILENO);
  if (!options.output_path.empty()) out = ::open(options.output_path.c_str(), O_WRONLY | O_CREAT, 0644);
  ::dup2(out, STDOUT_FILENO);
  if (!options.folder.empty() && ::chdir(options.folder.c_str()) != 0) ::_exit(126);
  if (options.file_size_limit_bytes) limit(RLIMIT_FSIZE, *options.file_size_limit_bytes);
  if (options.address_space_bytes) limit(RLIMIT_AS, *options.address_space_bytes);
  if (options.open_files) limit(RLIMIT_NOFILE, *options.open_files);
  limit(RLIMIT_CORE, 0);
  constexpr uid_t kNobody = 65534;
  if (options.without_privileges && ::geteuid() == 0 && ::setuid(kNobody) != 0) ::_exit(126);
  std::signal(SIGPIPE, SIG_DFL);
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& argument : command) arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  ::execv(arguments[0], arguments.data());
  ::_exit(127);
}

void close_if_open(int& file) {
  if (file >= 0) ::close(file);
  file = -1;
}

}  // namespace

RunningProgram::RunningProgram(const std::vector<std::string>& command, const RunOptions& options)
    : unsent_input_(options.input) {
  std::signal(SIGPIPE, SIG_IGN);  // a program that stops reading its input is no reason for the test to die
  Pipe in;
  Pipe out;
  Pipe err;
  // Before the program can write: one that is quick would find a reader.
  if (options.close_output) close_if_open(out.read_end);
  pid_ = ::fork();
  if (pid_ < 0) give_up("fork");
  if (pid_ == 0) become(command, options, in.read_end, out.write_end, err.write_end);
  ::close(in.read_end);
  ::close(out.write_end);
  ::close(err.write_end);
  in_ = in.write_end;
  out_ = out.read_end;
  err_ = err.read_end;
  ::fcntl(in_, F_SETFL, O_NONBLOCK);
}

RunningProgram::~RunningProgram() {
  if (pid_ > 0) {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  close_if_open(in_);
  close_if_open(out_);
  close_if_open(err_);
}

void RunningProgram::send(int signal) const {
  ::kill(pid_, signal);
}

void RunningProgram::feed_input() {
  const ssize_t sent = ::write(in_, unsent_input_.data(), unsent_input_.size());
  if (sent >= 0) unsent_input_.erase(0, static_cast<std::size_t>(sent));
  if (sent < 0 && errno != EAGAIN) unsent_input_.clear();
  if (unsent_input_.empty()) close_if_open(in_);
}

/// Reads whatever comes next; false at the end of both streams.
bool RunningProgram::read_some() {
  if (unsent_input_.empty()) close_if_open(in_);
  if (out_ < 0 && err_ < 0) return false;
  struct pollfd waits[3] = {{out_, POLLIN, 0}, {err_, POLLIN, 0}, {in_, POLLOUT, 0}};
  if (::poll(waits, 3, -1) < 0) {
    if (errno == EINTR) return true;
    give_up("poll");
  }
  if (in_ >= 0 && waits[2].revents != 0) feed_input();
  const auto drain = [](int& file, short events, std::string& text) {
    if (file < 0 || events == 0) return;
    char bytes[1 << 14];
    const ssize_t got = ::read(file, bytes, sizeof bytes);
    if (got > 0) text.append(bytes, static_cast<std::size_t>(got));
    if (got == 0) close_if_open(file);
  };
  drain(out_, waits[0].revents, result_.out);
  drain(err_, waits[1].revents, result_.err);
  return true;
}

bool RunningProgram::wait_for_error_text(const std::string& text) {
  while (result_.err.find(text) == std::string::npos) {
    if (!read_some()) return false;
  }
  return true;
}

RunResult RunningProgram::wait() {
  while (read_some()) {
  }
  int status = 0;
  while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
  }
  pid_ = -1;
  result_.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result_;
}

RunResult run_program(const std::vector<std::string>& command, const RunOptions& options) {
  return RunningProgram(command, options).wait();
}

std::string isohf_path() {
  return ISOHF_BIN_DIR "/isohf";
}

}  // namespace isohf::test
