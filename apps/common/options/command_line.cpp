#include "options/command_line.h"

#include <algorithm>
#include <cctype>

namespace isohf::cli {
namespace {

/// "--output" of "OUTPUT,-o,--output": what messages call an option.
std::string name_in(const std::string& names) {
  const std::size_t dashes = names.find("--");
  const std::size_t from = dashes == std::string::npos ? 0 : dashes;
  return names.substr(from, names.find(',', from) - from);
}

/// "--overwrite" or "-q": CLI11 takes any word for a value.
bool is_option(const std::string& word) {
  return word.starts_with("--") || (word.size() == 2 && word[0] == '-' && std::isalpha(word[1]) != 0);
}

}  // namespace

void group(CLI::App& line, const std::string& heading) {
  line.option_defaults()->group(heading);
}

void most_used(CLI::App& line, std::initializer_list<const char*> options) {
  for (const char* name : options) line.get_option(name)->group(kMostUsed);
}

CLI::Option* option(CLI::App& line, const std::string& names, const std::string& value_name, const std::string& text,
                    Take take) {
  const auto take_all = [&line, name = name_in(names), take = std::move(take)](const CLI::results_t& values) {
    // CLI11 calls this before it refuses an option without another that it needs.
    if (std::ranges::any_of(line.get_option(name)->get_needs(), [](const auto* other) { return other->count() == 0; }))
      return true;
    for (const std::string& value : values) {
      try {
        if (value.empty() || is_option(value))
          throw Error(ErrorCode::kInvalidArgument, ErrorParts{"", "'" + value + "'", "a value", ""});
        take(value);
      } catch (const Error& error) {
        throw BadValue{name, error};
      }
    }
    return true;
  };
  return line.add_option(names, take_all, text)->type_name(value_name);
}

CLI::Option* option(CLI::App& line, const std::string& names, const std::string& value_name, const std::string& text,
                    std::string& value) {
  return option(line, names, value_name, text, [&value](const std::string& word) { value = word; });
}

CLI::Option* repeated(CLI::App& line, const std::string& names, const std::string& value_name, const std::string& text,
                      Take take) {
  return option(line, names, value_name, text, std::move(take))->take_all();
}

CLI::Option* flag_with_value(CLI::App& line, const std::string& name, const std::string& value_name,
                             const std::string& text, std::function<void(const std::optional<std::string>&)> take) {
  return option(line, name, "[=" + value_name + "]", text,
                [take = std::move(take)](const std::string& word) {
                  if (word != "false") take(word == "true" ? std::nullopt : std::optional(word));
                })
      ->expected(0)
      ->default_str("true");
}

CLI::Option* positional(CLI::App& line, const std::string& names, const std::string& text, std::string& value) {
  return option(line, names, "", text, value)->required();
}

CLI::Option* positionals(CLI::App& line, const std::string& usage, const std::string& text,
                         std::vector<std::string>& values) {
  const std::size_t from = usage.starts_with('[') ? 1 : 0;
  return line.add_option(usage.substr(from, usage.find('.') - from), values, text)->type_name(usage)->take_all();
}

void exclusive(CLI::App& line, std::initializer_list<const char*> options) {
  for (const auto* one = options.begin(); one != options.end(); ++one) {
    for (const auto* other = one + 1; other != options.end(); ++other)
      line.get_option(*one)->excludes(line.get_option(*other));
  }
}

bool given(const CLI::App& line, const std::string& option) {
  return line.get_option(option)->count() > 0;
}

std::string first_given(const CLI::App& line, std::initializer_list<const char*> headings) {
  for (const CLI::Option* option : line.get_options()) {
    if (option->count() > 0 && std::ranges::find(headings, option->get_group()) != headings.end())
      return long_name(*option);
  }
  return {};
}

std::string invocation(const CLI::App& line) {
  return line.get_parent() == nullptr ? line.get_name() : line.get_parent()->get_name() + " " + line.get_name();
}

std::string long_name(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_name(true) : "--" + option.get_lnames().front();
}

std::vector<std::string> long_names(const CLI::App& line, const CLI::App& root) {
  std::vector<std::string> names;
  for (const CLI::App* app : {&line, &root}) {
    for (const CLI::Option* option : app->get_options()) {
      if (!option->get_lnames().empty()) names.push_back("--" + option->get_lnames().front());
    }
  }
  return names;
}

}  // namespace isohf::cli
