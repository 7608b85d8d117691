#include "options/command_line.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "isohf/error.h"
#include "options/config_file.h"
#include "options/help_page.h"
#include "options/option_values.h"
#include "output/standard_output.h"

namespace isohf::cli {
namespace {

using Values = std::vector<std::string>;

enum class Origin { kNowhere, kTopLevel, kSection, kCommandLine };

/// An option where it was met: `where` names it in messages.
struct Occurrence {
  std::string where;
  Values values;
};

struct Option {
  std::vector<std::string> names{};  ///< "-i", "--input"; none: a positional alone
  std::string positional{};          ///< what it is called where it stands without a name
  std::string value_name{};
  std::string description{};
  std::string group{};
  std::size_t values = 1;  ///< 0: a flag
  bool repeats = false;
  std::vector<std::string> words{};
  std::function<void(const Values&)> take = nullptr;  ///< the values of one occurrence
  std::vector<Occurrence> found{};
  Origin origin = Origin::kNowhere;

  [[nodiscard]] std::string name() const { return names.empty() ? positional : names.back(); }
  [[nodiscard]] bool is_called(const std::string& word) const {
    return std::find(names.begin(), names.end(), word) != names.end();
  }
  [[nodiscard]] bool is_set() const { return !found.empty() && (values > 0 || found.back().values.front() == "true"); }
  [[nodiscard]] bool takes_list() const { return value_name.find(',') != std::string::npos; }
};

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

std::span<const Command> all_commands;
std::vector<DeclaredOption>* declared = nullptr;  ///< where parse() lists the options instead of parsing

/// The names of the commands that know an option.
std::vector<std::string> commands_with(const std::string& option) {
  std::vector<std::string> names;
  for (const Command& command : all_commands) {
    const std::vector<DeclaredOption> options = options_of(command);
    if (std::any_of(options.begin(), options.end(), [&](const auto& known) { return known.name == option; })) {
      names.emplace_back(command.name);
    }
  }
  return names;
}

/// Whether a --config file may hold it: what is asked for once is asked for on the command line.
bool is_config_key(const std::string& option) {
  return option != "--config" && option != "--help" && option != "--version";
}

std::vector<std::string> keys_of(const Command& command) {
  std::vector<std::string> keys;
  for (const DeclaredOption& option : options_of(command)) {
    if (is_config_key(option.name)) keys.push_back(option.name.substr(2));
  }
  return keys;
}

/// What a value of the --config file comes down to on the command line.
std::vector<Values> values_from(const Option& option, const ConfigValue& value) {
  using Kind = ConfigValue::Kind;
  const auto mismatch = [&](const std::string& required) {
    refuse("found " + value.shown() + ", must be " + required);
  };
  const auto all_plain = [](const std::vector<ConfigValue>& items) {
    return !items.empty() && std::all_of(items.begin(), items.end(), [](const ConfigValue& item) {
      return item.kind == Kind::kText || item.kind == Kind::kNumber;
    });
  };
  const auto texts = [](const std::vector<ConfigValue>& items) {
    Values list;
    for (const ConfigValue& item : items) list.push_back(item.text);
    return list;
  };
  if (option.values == 0) {
    if (value.kind != Kind::kBoolean) mismatch("true or false");
    return {{value.text}};
  }
  if (value.kind == Kind::kBoolean) mismatch(option.value_name);
  if (option.values > 1) {
    const std::string required = fmt::format("an array of {} values, or an array of such arrays", option.values);
    if (value.kind != Kind::kArray) mismatch(required);
    const bool is_one = all_plain(value.items);
    std::vector<Values> found;
    for (const ConfigValue& item : is_one ? std::vector<ConfigValue>{value} : value.items) {
      if (item.items.size() != option.values || !all_plain(item.items)) mismatch(required);
      found.push_back(texts(item.items));
    }
    return found;
  }
  if (value.kind != Kind::kArray) return {{value.text}};
  if (!all_plain(value.items)) mismatch("an array of text or numbers, with something in it");
  if (!option.repeats && !option.takes_list()) mismatch("one value");
  const Values list = texts(value.items);
  if (!option.repeats) return {{fmt::format("{}", fmt::join(list, ","))}};
  std::vector<Values> found;
  for (const std::string& text : list) found.push_back({text});
  return found;
}

}  // namespace

struct CommandLine::State {
  std::string command;
  std::string summary;
  std::string group = "Options";
  std::string usage_positionals;
  std::string footer;
  std::string config;
  std::vector<Option> options;
  std::vector<std::set<std::string>> exclusive;

  [[nodiscard]] bool is_program() const { return program_name() == "isohf-" + command || program_name() == command; }
  [[nodiscard]] std::string invocation() const {
    return is_program() ? program_name() : program_name() + " " + command;
  }

  Option& add(const std::string& flags, Option option) {
    for (std::size_t from = 0; from < flags.size();) {
      const std::size_t to = std::min(flags.find(',', from), flags.size());
      const std::string name = flags.substr(from, to - from);
      (name.starts_with("-") ? option.names.emplace_back() : option.positional) = name;
      from = to + 1;
    }
    option.group = group;
    return options.emplace_back(std::move(option));
  }

  Option* find(const std::string& name) {
    const auto found =
        std::find_if(options.begin(), options.end(), [&](const Option& option) { return option.is_called(name); });
    return found == options.end() ? nullptr : &*found;
  }

  [[nodiscard]] std::vector<std::string> long_names() const {
    std::vector<std::string> names;
    for (const Option& option : options) {
      if (!option.names.empty()) names.push_back(option.name());
    }
    return names;
  }

  [[noreturn]] void refuse_usage(const std::string& why) const {
    refuse(fmt::format("{} ({} --help lists the options)", why, invocation()));
  }

  [[noreturn]] void refuse_unknown(const std::string& name) const {
    const std::string near = did_you_mean(name, long_names());
    const std::vector<std::string> others = commands_with(name);
    refuse_usage(fmt::format(
        "unknown option {}{}", name,
        !near.empty() || others.empty() ? near : fmt::format("; it belongs to {}", fmt::join(others, ", "))));
  }

  /// Whether an argument can be a value: neither a long option nor a letter of ours. "-5" can.
  [[nodiscard]] bool can_be_value(const std::string& argument) {
    return !argument.starts_with("--") && find(argument) == nullptr;
  }

  void place(const Arguments& arguments);
  std::size_t place_named(const Arguments& arguments, std::size_t at);
  std::size_t place_letters(const Arguments& arguments, std::size_t at);
  std::size_t place_values(Option& option, const Arguments& arguments, std::size_t next);
  void place_plain(const std::string& argument);
  void read_config();
  void check_entries(const std::vector<ConfigEntry>& entries);
  void place_entries(const std::vector<ConfigEntry>& entries, Origin origin);
  const Option* rival_of(const Option& option, Origin from);
  void take();
  void print_help() const;
};

void CommandLine::State::place(const Arguments& arguments) {
  Arguments plain;
  for (std::size_t i = 0; i < arguments.size();) {
    const std::string& argument = arguments[i];
    if (argument == "--") {
      plain.insert(plain.end(), arguments.begin() + static_cast<std::ptrdiff_t>(i) + 1, arguments.end());
      break;
    }
    if (argument.starts_with("--")) {
      i = place_named(arguments, i);
    } else if (argument.size() > 1 && argument.front() == '-') {
      i = place_letters(arguments, i);
    } else {
      plain.push_back(argument);
      ++i;
    }
  }
  for (const std::string& argument : plain) place_plain(argument);
}

/// An option by its long name at arguments[at]; the next argument to look at.
std::size_t CommandLine::State::place_named(const Arguments& arguments, std::size_t at) {
  const std::string& argument = arguments[at];
  const std::size_t equals = argument.find('=');
  const std::string name = argument.substr(0, equals);
  Option* const option = find(name);
  if (option == nullptr) refuse_unknown(name);
  if (equals == std::string::npos) return place_values(*option, arguments, at + 1);
  const std::string value = argument.substr(equals + 1);
  if (option->values == 2 && value.find(',') != std::string::npos) {
    return place_values(*option, {value}, 0) + at;
  }
  if (option->values == 0 && value != "true" && value != "false") {
    refuse_usage(fmt::format("{} is a flag and takes no value, found '{}'", name, value));
  }
  if (option->values > 1)
    refuse_usage(fmt::format("{0} takes {1} values: {0} {2}", name, option->values, option->value_name));
  option->found.push_back({name, {value}});
  option->origin = Origin::kCommandLine;
  return at + 1;
}

/// "-q", "-qv", "-j4" at arguments[at].
std::size_t CommandLine::State::place_letters(const Arguments& arguments, std::size_t at) {
  const std::string& argument = arguments[at];
  for (std::size_t i = 1; i < argument.size(); ++i) {
    Option* const option = find(std::string("-") + argument[i]);
    if (option == nullptr) refuse_unknown(argument);
    if (option->values == 0 || i + 1 == argument.size()) {
      const std::size_t next = place_values(*option, arguments, at + 1);
      if (i + 1 == argument.size()) return next;
      continue;
    }
    option->found.push_back({option->name(), {argument.substr(i + 1)}});
    option->origin = Origin::kCommandLine;
    break;
  }
  return at + 1;
}

/// The values that follow an option's name; the next argument to look at.
std::size_t CommandLine::State::place_values(Option& option, const Arguments& arguments, std::size_t next) {
  Values values;
  if (option.values == 0) values = {"true"};
  const auto is_there = [&](std::size_t i) { return i < arguments.size() && can_be_value(arguments[i]); };
  for (; values.size() < option.values; ++next) {
    if (is_there(next)) {
      // "1,2" and "1, 2" are two values as well.
      const std::size_t comma = option.values == 2 && values.empty() ? arguments[next].find(',') : std::string::npos;
      values.push_back(arguments[next].substr(0, comma));
      if (comma < arguments[next].size() - 1) values.push_back(arguments[next].substr(comma + 1));
    } else if (option.values == 1) {
      refuse_usage(fmt::format("{} lacks its value", option.name()));
    } else {
      refuse_usage(fmt::format("{0} takes {1} values: {0} {2}", option.name(), option.values, option.value_name));
    }
  }
  option.found.push_back({option.name(), std::move(values)});
  option.origin = Origin::kCommandLine;
  return next;
}

/// An argument without a name, to the first place that is free.
void CommandLine::State::place_plain(const std::string& argument) {
  for (Option& option : options) {
    if (option.positional.empty() || (!option.repeats && !option.found.empty())) continue;
    option.found.push_back({option.positional, {argument}});
    option.origin = Origin::kCommandLine;
    return;
  }
  refuse_usage(fmt::format("'{}' is one argument too many", argument));
}

/// An option that excludes `option` and comes from `from`, or from where goes before it.
const Option* CommandLine::State::rival_of(const Option& option, Origin from) {
  for (const std::set<std::string>& names : exclusive) {
    if (!names.contains(option.name())) continue;
    for (const std::string& name : names) {
      const Option* const other = find(name);
      if (other != nullptr && other != &option && other->is_set() && other->origin >= from) return other;
    }
  }
  return nullptr;
}

/// Every key must be an option's, in its section as at the top level.
void CommandLine::State::check_entries(const std::vector<ConfigEntry>& entries) {
  std::vector<std::string> own;
  for (const std::string& name : long_names()) {
    if (is_config_key(name)) own.push_back(name.substr(2));
  }
  for (const ConfigEntry& entry : entries) {
    const auto other = std::find_if(all_commands.begin(), all_commands.end(),
                                    [&](const Command& known) { return entry.section == known.name; });
    const bool is_own = entry.section == command;
    // A program of one command knows nothing of the others'.
    if (all_commands.empty() && !is_own) continue;
    if (!entry.section.empty() && !is_own && other == all_commands.end()) {
      std::vector<std::string> names;
      for (const Command& known : all_commands) names.emplace_back(known.name);
      refuse(fmt::format("{}: no command is called [{}]{}", entry.where, entry.section,
                         did_you_mean(entry.section, names)));
    }
    const std::vector<std::string> keys = other == all_commands.end() ? own : keys_of(*other);
    if (std::find(keys.begin(), keys.end(), entry.key) != keys.end()) continue;
    const std::vector<std::string> others =
        is_config_key("--" + entry.key) ? commands_with("--" + entry.key) : std::vector<std::string>{};
    if (entry.section.empty() && !others.empty()) continue;
    const std::string near = did_you_mean(entry.key, keys);
    refuse(fmt::format("{}: {} '{}'{}", entry.where,
                       entry.section.empty() ? "no option is named" : fmt::format("{} has no option", entry.section),
                       entry.key, others.empty() ? near : fmt::format("; it belongs to {}", fmt::join(others, ", "))));
  }
}

void CommandLine::State::place_entries(const std::vector<ConfigEntry>& entries, Origin origin) {
  const auto above = static_cast<Origin>(static_cast<int>(origin) + 1);
  for (const ConfigEntry& entry : entries) {
    if (entry.section != (origin == Origin::kSection ? command : "")) continue;
    Option* const option = find("--" + entry.key);
    if (option == nullptr || !is_config_key("--" + entry.key) || option->origin >= above ||
        rival_of(*option, above) != nullptr)
      continue;
    const std::string where = entry.where + ": " + entry.key;
    try {
      for (Values& values : values_from(*option, entry.value)) option->found.push_back({where, std::move(values)});
    } catch (const Error& error) {
      throw error.within(where);
    }
    if (!option->found.empty()) option->origin = origin;
  }
}

void CommandLine::State::read_config() {
  const Option* const option = find("--config");
  if (option->found.empty()) return;
  if (option->found.size() > 1) refuse_usage(fmt::format("--config is given {} times", option->found.size()));
  const std::vector<ConfigEntry> entries = read_config_file(option->found.front().values.front());
  check_entries(entries);
  place_entries(entries, Origin::kSection);
  place_entries(entries, Origin::kTopLevel);
}

void CommandLine::State::take() {
  for (const Option& option : options) {
    if (option.found.empty()) continue;
    if (const Option* const rival = option.is_set() ? rival_of(option, option.origin) : nullptr; rival != nullptr) {
      refuse_usage(fmt::format("{} excludes {}; at most one of them may be given", option.found.front().where,
                               rival->found.front().where));
    }
    if (option.values > 0 && !option.repeats && option.found.size() > 1) {
      refuse(fmt::format("{} is given {} times", option.name(), option.found.size()));
    }
    for (const Occurrence& occurrence : option.found) {
      try {
        if (option.take) option.take(occurrence.values);
      } catch (const Error& error) {
        const std::string word = occurrence.values.front().substr(0, occurrence.values.front().find(':'));
        const Error placed = error.within(occurrence.where);
        throw Error(placed.code(), placed.what() + did_you_mean(word, option.words), placed.parts());
      }
    }
  }
}

void CommandLine::State::print_help() const {
  HelpPage page;
  page.text(summary);
  page.usage(invocation() + usage_positionals + " [options]");
  std::vector<std::string> groups;
  for (const Option& option : options) {
    if (std::find(groups.begin(), groups.end(), option.group) == groups.end()) groups.push_back(option.group);
  }
  std::stable_partition(groups.begin(), groups.end(), [](const std::string& name) { return name != "Common"; });
  for (const std::string& name : groups) {
    page.heading(name + ":");
    for (const Option& option : options) {
      if (option.group != name) continue;
      std::string left = fmt::format("{}", fmt::join(option.names, ", "));
      if (left.starts_with("--")) left = "    " + left;
      if (!option.value_name.empty()) left += (left.empty() ? "" : " ") + option.value_name;
      page.row(left, option.description);
    }
  }
  page.text(footer);
  page.print();
}

CommandLine::CommandLine(const std::string& command, const std::string& summary) : state_(std::make_unique<State>()) {
  state_->command = command;
  state_->summary = summary;
}

CommandLine::~CommandLine() = default;

void CommandLine::group(const std::string& title) {
  state_->group = title;
}

void CommandLine::positional(const std::string& name, const std::string& description, std::string& value) {
  option(name, name, description, value);
  state_->usage_positionals += " " + name;
}

void CommandLine::positional(const std::string& name, const std::string& flags, const std::string& description,
                             std::string& value) {
  option(flags + "," + name, name, description, value);
  state_->usage_positionals += " " + name;
}

void CommandLine::positionals(const std::string& usage, const std::string& description,
                              std::vector<std::string>& values) {
  const std::size_t first = usage.find_first_not_of('[');
  const std::string name = usage.substr(first, usage.find_first_of(" .") - first);
  repeated(name, usage, description, values);
  state_->usage_positionals += " " + usage;
}

void CommandLine::option(const std::string& flags, const std::string& value_name, const std::string& description,
                         Take take) {
  const auto take_one = [take = std::move(take)](const Values& values) { take(values.front()); };
  state_->add(flags, {.value_name = value_name, .description = description, .take = take_one});
}

void CommandLine::option(const std::string& flags, const std::string& value_name, const std::string& description,
                         std::string& value) {
  option(flags, value_name, description, [&value](const std::string& text) { value = text; });
}

void CommandLine::repeated(const std::string& flags, const std::string& value_name, const std::string& description,
                           std::vector<std::string>& values) {
  option(flags, value_name, description, [&values](const std::string& text) { values.push_back(text); });
  state_->options.back().repeats = true;
}

void CommandLine::repeated_pair(const std::string& flags, const std::string& value_name, const std::string& description,
                                std::function<void(const std::string&, const std::string&)> take) {
  const auto take_two = [take = std::move(take)](const Values& values) { take(values[0], values[1]); };
  state_->add(flags,
              {.value_name = value_name, .description = description, .values = 2, .repeats = true, .take = take_two});
}

void CommandLine::flag(const std::string& flags, const std::string& description, bool& value,
                       std::function<void()> given) {
  const auto take = [&value, given = std::move(given)](const Values& values) {
    value = values.front() == "true";
    if (value && given) given();
  };
  state_->add(flags, {.description = description, .values = 0, .take = take});
}

void CommandLine::flag(const std::string& flags, const std::string& description, std::function<void()> given) {
  const auto take = [given = std::move(given)](const Values& values) {
    if (values.front() == "true") given();
  };
  state_->add(flags, {.description = description, .values = 0, .take = take});
}

void CommandLine::words(const std::vector<std::string>& words) {
  state_->options.back().words = words;
}

void CommandLine::exclusive(const std::vector<std::string>& options) {
  state_->exclusive.emplace_back(options.begin(), options.end());
}

void CommandLine::footer(const std::string& text) {
  state_->footer = text;
}

bool CommandLine::parse(const Arguments& arguments) {
  State& state = *state_;
  bool help = false;
  bool version = false;
  group("Common");
  option("--config", "FILE",
         "Read options from a TOML file: 'long-option = value' for every command, or below [COMMAND] for one; the "
         "command line wins",
         state.config);
  if (declared != nullptr) {
    for (const Option& option : state.options) {
      if (!option.names.empty()) {
        const std::string letter = option.names.size() > 1 ? option.names.front() : "";
        declared->push_back({option.name(), letter, option.group, option.values > 0});
      }
    }
    return false;
  }
  flag("-h,--help", "Print this help and exit", help);
  flag("-V,--version", "Print the version and exit", version);
  const auto asks = [&](const char* letter, const char* name) {
    const auto end = std::find(arguments.begin(), arguments.end(), "--");
    return std::any_of(arguments.begin(), end, [&](const auto& word) { return word == letter || word == name; });
  };
  if (asks("-h", "--help")) {
    state.print_help();
    return false;
  }
  if (asks("-V", "--version")) {
    print_version();
    return false;
  }
  try {
    state.place(arguments);
    state.read_config();
    state.take();
  } catch (const Error& error) {
    if (state.is_program()) throw;
    throw error.within(state.command);
  }
  return true;
}

void CommandLine::parse_recorded(const std::vector<std::pair<std::string, std::string>>& texts) {
  for (const auto& [name, text] : texts) {
    Option* const option = state_->find("--" + name);
    if (option == nullptr) refuse(name + ": is not an option of an input");
    const bool is_flag = option->values == 0;
    if (is_flag && text != "true") refuse(fmt::format("{}: found '{}', must be true", name, text));
    option->found.push_back({name, {text}});
    option->origin = Origin::kCommandLine;
  }
  state_->take();
}

bool CommandLine::given(const std::string& name) const {
  const Option* const option = state_->find(name);
  return option != nullptr && option->origin >= Origin::kSection && option->is_set();
}

std::string CommandLine::first_given(const std::vector<std::string>& groups) const {
  for (const Option& option : state_->options) {
    if (std::find(groups.begin(), groups.end(), option.group) != groups.end() && given(option.name())) {
      return option.name();
    }
  }
  return {};
}

std::vector<std::pair<std::string, std::string>> CommandLine::texts_in(const std::vector<std::string>& groups) const {
  std::vector<std::pair<std::string, std::string>> texts;
  for (const Option& option : state_->options) {
    if (std::find(groups.begin(), groups.end(), option.group) != groups.end() && option.is_set())
      texts.emplace_back(option.name(), option.found.back().values.front());
  }
  return texts;
}

void CommandLine::require(const std::string& name, const std::vector<std::string>& values) const {
  require(name, values.empty() ? std::string() : "given");
}

void CommandLine::require(const std::string& name, const std::string& value) const {
  if (!value.empty()) return;
  fail(fmt::format("no {} given (usage: {}{} [options])", name, state_->invocation(), state_->usage_positionals));
}

void CommandLine::fail(const std::string& why) const {
  if (state_->is_program()) refuse(why);
  throw Error(ErrorCode::kInvalidArgument, {state_->command, why, "", ""});
}

std::vector<DeclaredOption> options_of(const Command& command) {
  std::vector<DeclaredOption> found;
  std::vector<DeclaredOption>* const before = std::exchange(declared, &found);
  try {
    command.run({});
  } catch (...) {
    declared = before;
    throw;
  }
  declared = before;
  return found;
}

void set_commands(std::span<const Command> commands) {
  all_commands = commands;
}

}  // namespace isohf::cli
