#include "program.h"

#include <csignal>
#include <exception>
#include <new>

#include "isohf/base/error.h"
#include "standard_output.h"

namespace isohf::cli {
namespace {

std::string& name_of_program() {
  static std::string name = "isohf";
  return name;
}

int exit_code_for(ErrorCode code) {
  if (code == ErrorCode::kInvalidArgument) return kExitUsage;
  if (code == ErrorCode::kCancelled) return kExitInterrupted;
  return kExitFailed;
}

}  // namespace

const std::string& program_name() {
  return name_of_program();
}

int run_program(const char* name, int argc, char** argv, int (*body)(const Arguments& arguments)) {
  name_of_program() = name;
  // A closed pipe or a file over its size limit is an error that write() reports, not a reason to die.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return body(Arguments(argv + (argc > 0 ? 1 : 0), argv + argc));
  } catch (const OutputClosed&) {
    return kExitFailed;
  } catch (const Error& error) {
    print_error(error.what());
    return exit_code_for(error.code());
  } catch (const std::bad_alloc&) {
    print_error("out of memory");
    return kExitFailed;
  } catch (const std::exception& error) {
    print_error(std::string("internal error: ") + error.what());
    return kExitFailed;
  }
}

}  // namespace isohf::cli
