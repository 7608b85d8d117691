#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <initializer_list>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "isohf/error.h"
#include "options/option_values.h"

namespace isohf::cli {

/// What CLI11 has no words for: values of our own types, whose parsers throw Error.

/// Takes the text of a value; throws Error{kInvalidArgument} "found ..., must be ...".
using Take = std::function<void(const std::string& text)>;

/// Thrown while an option's value is taken; `option` is its long name, for whoever knows where it came from.
struct BadValue {
  std::string option;
  Error error;
};

/// Options that are declared from here on stand under this heading of --help.
void group(CLI::App& line, const std::string& heading);
/// The heading of what -h prints.
inline constexpr const char* kMostUsed = "Most used";
/// Moves options to that heading, in this order.
void most_used(CLI::App& line, std::initializer_list<const char*> options);

/// An option with a value, called `value_name` in --help. Given again, the last one counts. Words between bars
/// ("u16|u8|f32") are offered by completions.
CLI::Option* option(CLI::App& line, const std::string& names, const std::string& value_name, const std::string& text,
                    Take take);
CLI::Option* option(CLI::App& line, const std::string& names, const std::string& value_name, const std::string& text,
                    std::string& value);
/// An option that may be given again and again; `take` gets each of its values.
CLI::Option* repeated(CLI::App& line, const std::string& names, const std::string& value_name, const std::string& text,
                      Take take);
/// A flag that may take a value: "--fill" and "--fill=50". `take` gets the value, if there is one.
CLI::Option* flag_with_value(CLI::App& line, const std::string& name, const std::string& value_name,
                             const std::string& text, std::function<void(const std::optional<std::string>&)> take);
/// A value without a name, which must be there; `names` may hold flags as well ("OUTPUT,-o,--output").
CLI::Option* positional(CLI::App& line, const std::string& names, const std::string& text, std::string& value);
/// All values without a name that no positional before it takes; `usage` is how they are shown: "INPUT...".
CLI::Option* positionals(CLI::App& line, const std::string& usage, const std::string& text,
                         std::vector<std::string>& values);

/// An option whose values are words.
template <typename T, typename Value>
CLI::Option* choice(CLI::App& line, const std::string& names,
                    std::initializer_list<std::pair<const char*, T>> words_and_values, const std::string& text,
                    Value& value) {
  std::vector<std::string> words;
  std::vector<T> values;
  for (const auto& [word, meaning] : words_and_values) {
    words.emplace_back(word);
    values.push_back(meaning);
  }
  std::string shown;
  for (const std::string& word : words) shown += (shown.empty() ? "" : "|") + word;
  return option(line, names, shown, text,
                [words, values, &value](const std::string& word) { value = values[parse_word(word, words)]; });
}

/// At most one of these options may be given.
void exclusive(CLI::App& line, std::initializer_list<const char*> options);
/// Whether an option was given, on the command line or in the --config file.
[[nodiscard]] bool given(const CLI::App& line, const std::string& option);
/// The first of a heading's options that was given; empty if none was.
[[nodiscard]] std::string first_given(const CLI::App& line, std::initializer_list<const char*> headings);

/// How the command is called: "isohf convert".
[[nodiscard]] std::string invocation(const CLI::App& line);
/// An option's long name with its dashes, or that of a positional.
[[nodiscard]] std::string long_name(const CLI::Option& option);
/// The long names of a command's options, and of those that all commands have.
[[nodiscard]] std::vector<std::string> long_names(const CLI::App& line, const CLI::App& root);

}  // namespace isohf::cli
