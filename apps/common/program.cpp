#include "program.h"

#include <execinfo.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>

#include "isohf/base/file.h"
#include "output/json_output.h"

namespace isohf::cli {
namespace {

/// How errors are told of where the options are not parsed yet, or cannot be.
void prepare_telling(const Arguments& arguments) {
  for (std::size_t i = 0; i < arguments.size() && arguments[i] != "--"; ++i) {
    if (arguments[i] == "--json") telling().json = true;
    if (arguments[i] == "--progress=json") telling().json_notes = true;
    if (arguments[i] == "--progress" && i + 1 < arguments.size()) telling().json_notes = arguments[i + 1] == "json";
  }
}

/// What nothing can catch, as an exception where none may pass: one line, and no core file.
[[noreturn]] void end_in_one_line() noexcept {
  const auto say = [](const char* text) { static_cast<void>(::write(STDERR_FILENO, text, std::strlen(text)) < 0); };
  say(program_name().c_str());
  try {
    if (const std::exception_ptr thrown = std::current_exception()) std::rethrow_exception(thrown);
    // Nothing was thrown: there was no room to.
    say(": ended early, most likely for lack of memory");
  } catch (const std::bad_alloc&) {
    say(": out of memory");
  } catch (const std::exception& error) {
    say(": ended early: ");
    say(error.what());
  } catch (...) {
    say(": internal error");
  }
  say("\n");
  ::_exit(kExitFailed);
}

/// Runs before the constructors of this program's globals, which may find no memory either.
__attribute__((constructor(101))) void end_in_one_line_from_the_start() {
  std::set_terminate(end_in_one_line);
}

}  // namespace

void print_version() {
  StandardOutput out;
  out.write(telling().json ? json_text({{"name", program_name()}, {"version", ISOHF_VERSION}})
                           : program_name() + " " ISOHF_VERSION "\n");
  out.finish();
}

int run_program(const char* name, int argc, char** argv, int (*body)(const Arguments& arguments)) {
  occupy_standard_descriptors();
  program_name() = name;
  // The C library loads what unwinds a stack when it is needed first, and aborts where there is no memory left for that.
  void* frame = nullptr;
  static_cast<void>(::backtrace(&frame, 1));
  // A closed pipe or a file over its size limit is an error that write() reports, not a reason to die at once: what is
  // half written is removed first.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  const Arguments arguments(argv + (argc > 0 ? 1 : 0), argv + argc);
  prepare_telling(arguments);
  try {
    return body(arguments);
  } catch (const OutputClosed&) {
    // The end that cat and gdalinfo meet. 0 would claim that verify found nothing.
    std::signal(SIGPIPE, SIG_DFL);
    std::raise(SIGPIPE);
    return kExitOutputClosed;  // where the signal is blocked
  } catch (const Error& error) {
    return print_error(error, exit_code_for(error.code()));
  } catch (const std::bad_alloc&) {
    return print_error(Error(ErrorCode::kOutOfMemory, "out of memory"), kExitFailed);
  } catch (const std::exception& error) {
    // oneTBB's words; it starts its threads when there is work.
    if (std::string_view(error.what()).starts_with("pthread_create")) {
      return print_error(Error(ErrorCode::kOutOfMemory, "the system lets no more threads start; give fewer, as -j 1"),
                         kExitFailed);
    }
    return print_internal_error(error.what());
  }
}

void become_program(const std::string& name, const Arguments& arguments) {
  std::vector<char*> words = {const_cast<char*>(name.c_str())};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  // What run_program() ignores would stay ignored.
  std::signal(SIGPIPE, SIG_DFL);
  std::signal(SIGXFSZ, SIG_DFL);
  std::error_code unknown;
  const std::filesystem::path here = std::filesystem::read_symlink("/proc/self/exe", unknown).parent_path();
  if (!unknown) ::execv((here / name).c_str(), words.data());
  ::execvp(name.c_str(), words.data());
  const std::string why =
      errno == ENOENT ? "is not installed, neither beside isohf nor on the path" : std::strerror(errno);
  throw Error(ErrorCode::kUnsupported, name + ": " + why);
}

}  // namespace isohf::cli
