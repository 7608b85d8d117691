#include "command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <utility>

#include "isohf/base/error.h"
#include "standard_output.h"

namespace isohf::cli {
namespace {

constexpr std::size_t kHelpWidth = 100;
constexpr std::size_t kNameWidth = 28;

/// Breaks `text` at blanks so that no line is longer than `width`; lines after the first start with `indent` blanks.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t width) {
  std::string out;
  std::size_t column = indent;
  std::size_t from = 0;
  while (from < text.size()) {
    const std::size_t to = std::min(text.find(' ', from), text.size());
    const std::size_t length = to - from;
    if (column > indent && column + 1 + length > width) {
      out += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (column > indent) {
      out += ' ';
      ++column;
    }
    out.append(text, from, length);
    column += length;
    from = to + 1;
  }
  return out;
}

/// Usage, then one list of options a group, "Common" last; two columns, wrapped, and nothing of CLI11's own notes.
class HelpFormatter : public CLI::Formatter {
 public:
  explicit HelpFormatter(std::string usage) : usage_(std::move(usage)) {}

  [[nodiscard]] std::string make_help(const CLI::App* app, std::string /*name*/,
                                      CLI::AppFormatMode /*mode*/) const override {
    std::string help = fmt::format("{}\n\nUsage: isohf {}\n", app->get_description(), usage_);
    std::vector<std::string> groups = app->get_groups();
    std::stable_partition(groups.begin(), groups.end(), [](const std::string& group) { return group != "Common"; });
    for (const std::string& group : groups) {
      std::string lines;
      for (const CLI::Option* option : app->get_options()) {
        if (option->get_group() == group) lines += describe(option);
      }
      if (!lines.empty()) help += fmt::format("\n{}:\n{}", group, lines);
    }
    return help + "\n" + app->get_footer() + "\n";
  }

 private:
  static std::string describe(const CLI::Option* option) {
    std::string line = "  ";
    for (const std::string& flag : option->get_snames()) line += "-" + flag + ", ";
    if (option->get_snames().empty() && !option->get_lnames().empty()) line += "    ";
    for (const std::string& flag : option->get_lnames()) line += "--" + flag + " ";
    if (option->get_lnames().empty() || option->get_type_size() != 0) line += option->get_type_name();
    if (line.size() + 2 > kNameWidth) {
      line += "\n" + std::string(kNameWidth, ' ');
    } else {
      line.resize(kNameWidth, ' ');
    }
    return line + wrapped(option->get_description(), kNameWidth, kHelpWidth) + "\n";
  }

  std::string usage_;
};

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
    }
  }
  return row[b.size()];
}

}  // namespace

namespace {

/// An option that may stand without a value.
struct Lone {
  std::string meaning;
  std::function<bool(const std::string&)> is_value;
};

bool is_numbers(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789.,") == std::string::npos;
}

/// Ties options that may stand alone to the values that follow them, or to what they mean alone.
Arguments with_values(const Arguments& given, const std::map<std::string, Lone>& alone) {
  Arguments out;
  for (std::size_t i = 0; i < given.size(); ++i) {
    const auto found = alone.find(given[i]);
    if (found == alone.end()) {
      out.push_back(given[i]);
      if (given[i] == "--") {
        out.insert(out.end(), given.begin() + static_cast<std::ptrdiff_t>(i) + 1, given.end());
        break;
      }
      continue;
    }
    const bool has_value = i + 1 < given.size() && found->second.is_value(given[i + 1]);
    out.push_back(given[i] + "=" + (has_value ? given[i + 1] : found->second.meaning));
    if (has_value) ++i;
  }
  return out;
}

/// CLI11's "--at: 2 required X Z missing" in the words of this program.
std::string why_mismatched(const std::string& text) {
  const std::size_t required = text.find(" required ");
  const std::size_t missing = text.find(" missing");
  if (required == std::string::npos || missing == std::string::npos) return text;
  const std::size_t colon = text.find(": ");
  const std::string option = text.substr(0, colon);
  const std::string count = text.substr(colon + 2, required - colon - 2);
  if (count == "1") return option + " lacks its value";
  const std::size_t value = required + std::string(" required ").size();
  return fmt::format("{} takes {} values: {} {}", option, count, option, text.substr(value, missing - value));
}

}  // namespace

std::string nearest_word(const std::string& text, const std::vector<std::string>& candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, text.size() / 3) + 1;
  for (const std::string& candidate : candidates) {
    std::size_t distance = edit_distance(text, candidate);
    if (text.size() >= 3 && candidate.compare(0, text.size(), text) == 0) distance = 1;
    if (distance < best_distance) {
      best_distance = distance;
      best = candidate;
    }
  }
  return best;
}

struct CommandLine::State {
  State(const std::string& name, const std::string& summary) : command(name), app(summary, name) {}

  std::string command;
  CLI::App app;
  std::string group = "Options";
  std::string usage_positionals;
  std::map<std::string, Lone> alone;  ///< options that may stand without a value, and what that means

  /// The long name in "-q,--quiet" or "-i,--input,INPUT" as the user writes it.
  static std::string long_name(const std::string& flags) {
    const std::size_t from = flags.find("--");
    return flags.substr(from, flags.find(',', from) - from);
  }

  [[nodiscard]] std::vector<std::string> long_names() const {
    std::vector<std::string> names;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    }
    return names;
  }

  /// What is wrong with an argument that CLI11 could not place.
  [[nodiscard]] std::string why_unexpected() const {
    for (const std::string& extra : app.remaining()) {
      if (extra.size() < 2 || extra[0] != '-') continue;
      const std::string near = nearest_word(extra.substr(0, extra.find('=')), long_names());
      return fmt::format("unknown option {}{}", extra, near.empty() ? "" : fmt::format("; did you mean {}?", near));
    }
    return fmt::format("'{}' is one argument too many", app.remaining().empty() ? "" : app.remaining().front());
  }
};

CommandLine::CommandLine(const std::string& command, const std::string& summary)
    : state_(std::make_unique<State>(command, summary)) {
  state_->app.set_help_flag("-h,--help", "Print this help and exit");
  state_->app.get_help_ptr()->group("Common");
  state_->app.allow_config_extras(CLI::config_extras_mode::error);
}

CommandLine::~CommandLine() = default;

void CommandLine::group(const std::string& title) {
  state_->group = title;
}

void CommandLine::positional(const std::string& name, const std::string& flags, const std::string& description,
                             std::string& value) {
  option(flags + "," + name, name, description, [&value](const std::string& text) { value = text; });
  state_->usage_positionals += " " + name;
}

void CommandLine::positionals(const std::string& usage, const std::string& description,
                              std::vector<std::string>& values) {
  const std::size_t first = usage.find_first_not_of('[');
  const std::string name = usage.substr(first, usage.find_first_of(" .") - first);
  state_->app.add_option(name, values, description)->type_name(usage)->group(state_->group);
  state_->usage_positionals += " " + usage;
}

void CommandLine::option(const std::string& flags, const std::string& value_name, const std::string& description,
                         Take take) {
  const std::string name = State::long_name(flags);
  const auto callback = [name, take = std::move(take)](const std::vector<std::string>& values) {
    if (values.size() != 1) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("{} is given {} times", name, values.size()));
    }
    try {
      take(values.front());
    } catch (const Error& error) {
      throw error.within(name);
    }
    return true;
  };
  state_->app.add_option(flags, callback, description)
      ->type_name(value_name)
      ->group(state_->group)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false);
}

void CommandLine::option(const std::string& flags, const std::string& value_name, const std::string& description,
                         std::string& value) {
  option(flags, value_name, description, [&value](const std::string& text) { value = text; });
}

void CommandLine::option_or_numbers(const std::string& flag, const std::string& value_name, const std::string& alone,
                                    const std::string& description, Take take) {
  option_or_value(flag, value_name, alone, is_numbers, description, std::move(take));
}

void CommandLine::option_or_value(const std::string& flag, const std::string& value_name, const std::string& alone,
                                  std::function<bool(const std::string&)> is_value, const std::string& description,
                                  Take take) {
  option(flag, value_name, description, std::move(take));
  state_->alone[flag] = {alone, std::move(is_value)};
}

void CommandLine::repeated(const std::string& flags, const std::string& value_name, const std::string& description,
                           std::vector<std::string>& values) {
  const auto callback = [&values](const std::vector<std::string>& found) {
    values.insert(values.end(), found.begin(), found.end());
    return true;
  };
  state_->app.add_option(flags, callback, description)
      ->type_name(value_name)
      ->group(state_->group)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false);
}

void CommandLine::repeated_pair(const std::string& flags, const std::string& value_name, const std::string& description,
                                std::function<void(const std::string&, const std::string&)> take) {
  const std::string name = State::long_name(flags);
  const auto callback = [name, take = std::move(take)](const std::vector<std::string>& values) {
    try {
      for (std::size_t i = 0; i + 1 < values.size(); i += 2) take(values[i], values[i + 1]);
    } catch (const Error& error) {
      throw error.within(name);
    }
    return true;
  };
  state_->app.add_option(flags, callback, description)
      ->type_name(value_name)
      ->group(state_->group)
      ->type_size(2)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->allow_extra_args(false);
}

void CommandLine::flag(const std::string& flags, const std::string& description, bool& value) {
  state_->app.add_flag(flags, value, description)->group(state_->group);
}

void CommandLine::exclusive(const std::vector<std::string>& options) {
  for (std::size_t i = 0; i < options.size(); ++i) {
    for (std::size_t j = i + 1; j < options.size(); ++j) {
      state_->app.get_option(options[i])->excludes(state_->app.get_option(options[j]));
    }
  }
}

void CommandLine::footer(const std::string& text) {
  state_->app.footer(text);
}

bool CommandLine::parse(const Arguments& given) {
  CLI::App& app = state_->app;
  const Arguments arguments = with_values(given, state_->alone);
  app.set_config("--config", "",
                 "Read options from a TOML or INI file: one 'long-option = value' a line; the command "
                 "line wins")
      ->type_name("FILE")
      ->group("Common");
  app.formatter(std::make_shared<HelpFormatter>(state_->command + state_->usage_positionals + " [options]"));
  const auto fail = [&](const std::string& why) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: {} (isohf {} --help lists the options)", state_->command, why, state_->command));
  };
  try {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
  } catch (const CLI::CallForHelp&) {
    StandardOutput out;
    out.write(app.help());
    out.finish();
    return false;
  } catch (const CLI::ExtrasError&) {
    fail(state_->why_unexpected());
  } catch (const CLI::ArgumentMismatch& error) {
    fail(why_mismatched(error.what()));
  } catch (const CLI::ExcludesError& error) {
    fail(std::string(error.what()) + "; at most one of them may be given");
  } catch (const CLI::FileError& error) {
    fail(std::string("--config: ") + error.what());
  } catch (const CLI::ConfigError& error) {
    // "INI was not able to parse density2"
    const std::string text = error.what();
    fail("--config: no option is named " + text.substr(text.rfind(' ') + 1));
  } catch (const CLI::ParseError& error) {
    fail(error.what());
  } catch (const Error& error) {
    throw error.within(state_->command);
  }
  return true;
}

bool CommandLine::given(const std::string& option) const {
  return state_->app.get_option(option)->count() > 0;
}

void CommandLine::require(const std::string& name, const std::vector<std::string>& values) const {
  require(name, values.empty() ? std::string() : "given");
}

void CommandLine::require(const std::string& name, const std::string& value) const {
  if (!value.empty()) return;
  throw Error(ErrorCode::kInvalidArgument, fmt::format("{}: no {} given (usage: isohf {}{} [options])", state_->command,
                                                       name, state_->command, state_->usage_positionals));
}

}  // namespace isohf::cli
