#include "program.h"

#include <execinfo.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <new>
#include <nlohmann/json.hpp>

#include "isohf/base/file.h"
#include "isohf/base/simd.h"
#include "isohf/error.h"
#include "options/command_line.h"
#include "options/help_formatter.h"
#include "options/option_values.h"
#include "options/toml_config.h"
#include "output/json_output.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

/// For terminate handlers.
const char* program_name = "isohf";

/// What nothing can catch, as an exception where none may pass: one line, and no core file.
[[noreturn]] void end_in_one_line() noexcept {
  const auto say = [](const char* text) { static_cast<void>(::write(STDERR_FILENO, text, std::strlen(text)) < 0); };
  say(program_name);
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

/// How errors are reported before the options are parsed.
void look_ahead(const Arguments& arguments, Common& common) {
  for (std::size_t i = 0; i < arguments.size() && arguments[i] != "--"; ++i) {
    if (arguments[i] == "--json") common.json = true;
    if (arguments[i] == "--progress=json") common.json_notes = true;
    if (arguments[i] == "--progress" && i + 1 < arguments.size()) common.json_notes = arguments[i + 1] == "json";
  }
}

void add_common(CLI::App& root, Common& common) {
  root.add_flag("--json", common.json, "Print one JSON document instead of text, errors included");
  root.add_flag("-q,--quiet", common.quiet, "Print only errors, and warnings of lost data");
  root.add_flag("-v,--verbose", common.verbose, "Print more, to standard error");
  root.add_flag("--strict", common.strict, "Treat warnings as errors: write nothing");
}

[[noreturn]] void refuse_usage(const CLI::App& line, const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, fmt::format("{} ({} --help lists the options)", why, invocation(line)));
}

/// Words that no option and no positional takes.
[[noreturn]] void refuse_extras(const CLI::App& root, const CLI::App& line) {
  const std::vector<std::string> extras = root.remaining(true);
  const auto option = std::find_if(extras.begin(), extras.end(),
                                   [](const std::string& word) { return word.size() > 1 && word.front() == '-'; });
  if (option == extras.end()) {
    if (&line == &root && root.get_require_subcommand_min() > 0) {
      std::vector<std::string> names = {"help"};
      for (const CLI::App* command : root.get_subcommands({})) names.push_back(command->get_name());
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("unknown command '{}'{} ({} --help lists the commands)", extras.front(),
                              did_you_mean(extras.front(), names), root.get_name()));
    }
    refuse_usage(line, fmt::format("'{}' is one argument too many", extras.front()));
  }
  const std::string name = option->substr(0, option->find('='));
  refuse_usage(line, fmt::format("unknown option {}{}", name, did_you_mean(name, long_names(line, root))));
}

/// Parses; throws Error for wrong usage. False if help or the version was printed.
bool parse(CLI::App& root, const Arguments& arguments, const Common& common) {
  const auto config = std::make_shared<TomlConfig>(root);
  root.config_formatter(config);
  const auto line = [&]() -> const CLI::App& {
    const auto chosen = root.get_subcommands();
    return chosen.empty() ? root : *chosen.front();
  };
  const auto print = [&](const std::string& text) {
    StandardOutput out(common);
    out.write_styled(text);
    out.finish();
    return false;
  };
  try {
    std::vector<std::string> words(arguments.rbegin(), arguments.rend());  // CLI11 takes the last one first
    root.parse(words);
    return true;
  } catch (const CLI::CallForVersion&) {
    return print(common.json ? json_text({{"name", root.get_name()}, {"version", ISOHF_VERSION}})
                             : root.get_name() + " " ISOHF_VERSION "\n");
  } catch (const CLI::CallForHelp&) {
    return print(root.help("", CLI::AppFormatMode::Normal));
  } catch (const CLI::CallForAllHelp&) {
    return print(root.help("", CLI::AppFormatMode::All));
  } catch (const BadValue& bad) {
    throw bad.error.within(config->place_of(bad.option));
  } catch (const CLI::ExtrasError&) {
    refuse_extras(root, line());
  } catch (const CLI::RequiredError& error) {
    if (&line() == &root && root.get_require_subcommand_min() > 0) {
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("no command given ({} --help lists the commands)", root.get_name()));
    }
    refuse_usage(line(), error.what());
  } catch (const CLI::ParseError& error) {
    refuse_usage(line(), error.what());
  }
}

/// ISOHF_SIMD=off runs the plain twins of vectorised code, for tests and for finding faults.
void choose_simd() {
  const char* const setting = std::getenv("ISOHF_SIMD");
  const std::string_view text = setting == nullptr ? "on" : setting;
  if (text != "on" && text != "off") {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("the environment variable ISOHF_SIMD is '{}', must be on or off", text));
  }
  set_simd(text == "on");
}

int parse_and_run(const Program& program, Arguments arguments, Common& common) {
  // "help convert" is "convert --help".
  if (program.has_commands() && !arguments.empty() && arguments.front() == "help") {
    arguments.erase(arguments.begin());
    arguments.emplace_back("--help");
  }
  choose_simd();
  CLI::App root(program.summary, program.name);
  const std::map<const CLI::App*, Run> runs = declare(program, root, common);
  if (!parse(root, arguments, common)) return kExitDone;
  const CLI::App* const line = program.has_commands() ? root.get_subcommands().front() : &root;
  common.name = invocation(*line);
  return runs.at(line)();
}

}  // namespace

std::map<const CLI::App*, Run> declare(const Program& program, CLI::App& root, Common& common) {
  group(root, "Options of every command");
  root.set_help_flag("-h", "Print the most used options");
  root.set_help_all_flag("--help", "Print all options");
  root.set_version_flag("-V,--version", ISOHF_VERSION, "Print the version");
  root.formatter(std::make_shared<HelpFormatter>(common));
  root.footer(program.footer);
  root.fallthrough();
  root.option_defaults()->take_last();
  root.set_config("--config", "", "Read options from a TOML file; the command line wins")->type_name("FILE");
  root.allow_config_extras(CLI::config_extras_mode::ignore);  // TomlConfig checks them
  add_common(root, common);
  std::map<const CLI::App*, Run> runs;
  if (program.has_commands()) root.require_subcommand(1);
  for (const Command& command : program.commands) {
    CLI::App& line = program.has_commands() ? *root.add_subcommand(command.name, command.summary) : root;
    if (program.has_commands()) line.group(command.heading)->footer("");
    group(line, "Arguments");
    runs[&line] = command.add(line, common);
  }
  return runs;
}

int run(const Program& program, const Arguments& arguments, Common common) {
  common.name = program.name;
  look_ahead(arguments, common);
  try {
    return parse_and_run(program, arguments, common);
  } catch (const OutputClosed&) {
    return kExitOutputClosed;
  } catch (const Error& error) {
    return print_error(common, error, exit_code_for(error.code()));
  } catch (const std::bad_alloc&) {
    return print_error(common, Error(ErrorCode::kOutOfMemory, "out of memory"), kExitFailed);
  } catch (const std::exception& error) {
    // oneTBB's words; it starts its threads when there is work.
    if (std::string_view(error.what()).starts_with("pthread_create")) {
      return print_error(common,
                         Error(ErrorCode::kOutOfMemory, "the system lets no more threads start; give fewer, as -j 1"),
                         kExitFailed);
    }
    return print_internal_error(common, error.what());
  }
}

int run_main(const Program& program, int argc, char** argv) {
  occupy_standard_descriptors();
  program_name = program.name;
  // The C library loads what unwinds a stack when it is needed first, and aborts where there is no memory left for that.
  void* frame = nullptr;
  static_cast<void>(::backtrace(&frame, 1));
  // A closed pipe or a file over its size limit is an error that write() reports, not a reason to die at once: what is
  // half written is removed first.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  const int code = run(program, Arguments(argv + (argc > 0 ? 1 : 0), argv + argc));
  if (code == kExitOutputClosed) {
    // The end that cat and gdalinfo meet. 0 would claim that verify found nothing.
    std::signal(SIGPIPE, SIG_DFL);
    std::raise(SIGPIPE);
  }
  return code;
}

void become_program(const std::string& name, const Arguments& arguments) {
  std::vector<char*> words = {const_cast<char*>(name.c_str())};
  for (const std::string& argument : arguments) words.push_back(const_cast<char*>(argument.c_str()));
  words.push_back(nullptr);
  // What run_main() ignores would stay ignored.
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
