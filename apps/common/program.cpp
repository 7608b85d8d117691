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

/// Ends with one line, and no core file, for an exception where none may pass, or no memory to throw one.
[[noreturn]] void end_in_one_line() noexcept {
  for (const char* text : {program_name, ": ended early, most likely for lack of memory\n"})
    static_cast<void>(::write(STDERR_FILENO, text, std::strlen(text)) < 0);
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
  root.add_flag("-v,--verbose", common.verbose, "Print more");
  root.add_flag("--strict", common.strict, "Treat warnings as errors: write nothing");
}

[[noreturn]] void refuse_usage(const CLI::App& line, const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, fmt::format("{} ({} --help lists the {})", why, invocation(line),
                                                       line.get_subcommands({}).empty() ? "options" : "commands"));
}

/// The words as CLI11 has to read them. It takes "[a,b]" and "{}" for lists and "++" for an end of the command, it
/// forgets what "--" means once a command has its arguments, and "--name=" takes the next word.
std::vector<std::string> words_for_parser(const Arguments& arguments) {
  std::vector<std::string> words;
  const auto files = std::ranges::find(arguments, "--");
  for (auto word = arguments.begin(); word != arguments.end(); ++word) {
    if (word == files) continue;
    // GDAL's -of and -outsize would be an output called "f".
    if (word < files && word->starts_with("-o") && word->size() > 2)
      throw Error(ErrorCode::kInvalidArgument, "unknown option " + *word + "; -o OUTPUT takes its value after a blank");
    const bool is_file = word > files && word->starts_with('-') && *word != "-";
    const bool is_list = word->starts_with('[') && word->ends_with(']');
    const bool is_empty = word < files && word->starts_with("--") && word->find('=') + 1 == word->size();
    words.push_back(is_empty ? word->substr(0, word->size() - 1) : *word);
    if (is_file || is_list || *word == "{}" || *word == "%%" || *word == "++") words.back().insert(0, "./");
    if (is_empty) words.emplace_back();
  }
  return words;
}

/// A message of CLI11's.
std::string in_plain_words(const CLI::App& line, const std::string& text) {
  const auto before = [&](const char* mark) { return text.substr(0, text.find(mark)); };
  if (text == "A subcommand is required") return "no command given";
  if (text.ends_with(" is required")) {
    const std::string name = before(" is required");
    const CLI::Option* const option = line.get_option_no_throw(name);
    return "no " + (option != nullptr && option->get_positional() ? option->get_name(true) : name) + " given";
  }
  if (text.find(": 1 required") != std::string::npos) return before(": 1 required") + " lacks its value";
  if (text.ends_with(" was not readable (missing?)")) return "--config: " + before(" was not") + ": cannot be read";
  const std::string flag = "Could not convert: ";
  return text.starts_with(flag) ? before(" = ").substr(flag.size()) + " takes no value" : text;
}

/// Words that no option and no positional takes.
void refuse_extras(const CLI::App& root, const CLI::App& line) {
  const std::vector<std::string> extras = root.remaining(true);
  if (extras.empty()) return;
  const auto option = std::ranges::find_if(extras, [](const auto& word) { return word.size() > 1 && word[0] == '-'; });
  if (option != extras.end()) {
    const std::string name = option->substr(0, option->find('='));
    const std::vector<std::string> known = long_names(line, root);
    if (std::ranges::find(known, name) != known.end()) refuse_usage(line, name + " must follow the command");
    refuse_usage(line, fmt::format("unknown option {}{}", name, did_you_mean(name, known)));
  }
  const std::string& word = extras.front();
  if (line.get_subcommands({}).empty()) refuse_usage(line, fmt::format("'{}' is one argument too many", word));
  std::vector<std::string> names = {"help"};
  for (const CLI::App* command : root.get_subcommands({})) names.push_back(command->get_name());
  refuse_usage(line, fmt::format("unknown command '{}'{}", word, did_you_mean(word, names)));
}

/// Throws Error for wrong usage, and CLI::Success where help or the version is requested.
void parse(CLI::App& root, std::vector<std::string> words) {
  const auto config = std::make_shared<TomlConfig>(root);
  root.config_formatter(config);
  try {
    std::ranges::reverse(words);  // CLI11 takes the last one first
    root.parse(words);
  } catch (const BadValue& bad) {
    throw bad.error.within(config->place_of(bad.option));
  } catch (const CLI::Success&) {
    throw;
  } catch (const CLI::ParseError& error) {
    const auto chosen = root.get_subcommands();
    const CLI::App& line = chosen.empty() ? root : *chosen.front();
    refuse_extras(root, line);
    refuse_usage(line, in_plain_words(line, error.what()));
  }
}

int print(const Common& common, const std::string& text) {
  StandardOutput out(common);
  out.write_styled(text);
  out.finish();
  return kExitDone;
}

/// Becomes the program `name`, which is next to this one or on the path, with the same descriptors.
[[noreturn]] void become_program(const std::string& name, const Arguments& arguments) {
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

/// A command that is another program gets all other words, as it is the only one to know their meaning.
void run_other_program(const Program& program, const Arguments& arguments) {
  auto word = arguments.begin();
  for (; word != arguments.end() && word->starts_with('-'); ++word) {
    if (*word == "--config" && word + 1 != arguments.end()) ++word;
  }
  for (const Command& command : program.commands) {
    if (command.program == nullptr || word == arguments.end() || *word != command.name) continue;
    Arguments others(arguments.begin(), word);
    others.insert(others.end(), word + 1, arguments.end());
    become_program(command.program, others);
  }
}

int parse_and_run(const Program& program, Arguments arguments, Common& common) {
  // "help convert" is "convert --help".
  if (program.has_commands() && !arguments.empty() && arguments.front() == "help") {
    std::vector<std::string> names;
    for (const Command& command : program.commands) names.emplace_back(command.name);
    if (arguments.size() > 1 && !arguments[1].starts_with('-') && std::ranges::find(names, arguments[1]) == names.end())
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("unknown command '{}'{}", arguments[1], did_you_mean(arguments[1], names)));
    *std::rotate(arguments.begin(), arguments.begin() + 1, arguments.end()) = "--help";
  }
  run_other_program(program, arguments);
  // The plain twins of vectorised code, for tests and for finding faults.
  const char* const simd = std::getenv("ISOHF_SIMD");
  set_simd(simd == nullptr || std::string_view(simd) != "off");
  CLI::App root(program.summary, program.name);
  const std::map<const CLI::App*, Run> runs = declare(program, root, common);
  const auto line = [&]() -> const CLI::App& {
    return root.get_subcommands().empty() ? root : *root.get_subcommands().front();
  };
  const std::vector<std::string> words = words_for_parser(arguments);
  const auto has = [&](const char* option) { return std::ranges::find(words, option) != words.end(); };
  const auto help = [&] { return root.help("", has("--help") ? CLI::AppFormatMode::All : CLI::AppFormatMode::Normal); };
  try {
    parse(root, words);
  } catch (const CLI::CallForVersion&) {
    return print(common, common.json ? json_text({{"name", program.name}, {"version", ISOHF_VERSION}})
                                     : fmt::format("{} {}\n", program.name, ISOHF_VERSION));
  } catch (const CLI::Success&) {
    return print(common, help());
  } catch (const Error&) {
    common.name = invocation(line());
    if (has("-h") || has("--help")) return print(common, help());
    throw;
  }
  common.name = invocation(line());
  return runs.at(&line())();
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
    if (command.program != nullptr) {
      line.set_help_flag();
      line.set_help_all_flag();
      continue;
    }
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
    return print_error(common, Error(ErrorCode::kUnsupported, std::string("internal error: ") + error.what()),
                       kExitFailed);
  }
}

int run_main(const Program& program, int argc, char** argv) {
  occupy_standard_descriptors();
  program_name = program.name;
  // The C library loads what unwinds a stack when it is needed first, and aborts where there is no memory left for
  // that.
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

}  // namespace isohf::cli
