#include "options/toml_config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <istream>

#include "isohf/error.h"
#include "options/command_line.h"

namespace isohf::cli {
namespace {

/// A "key = value" of a file.
struct Entry {
  std::string section;  ///< empty at the top level
  std::string key;
  const toml::node* value;
  std::size_t line;
};

[[noreturn]] void refuse_at(const std::string& where, const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, where + ": " + why);
}

std::string trimmed(const std::string& text) {
  const std::size_t from = std::min(text.find_first_not_of(" \t\r"), text.size());
  return text.substr(from, text.find_last_not_of(" \t\r") + 1 - from);
}

/// Why a line is not TOML: mostly, its text lacks quotes.
std::string why_malformed(const std::string& content, std::size_t number, std::string_view complaint) {
  std::istringstream lines(content);
  std::string line;
  for (std::size_t i = 0; i < number; ++i) std::getline(lines, line);
  const std::size_t equals = line.find('=');
  const std::string value = equals == std::string::npos ? "" : trimmed(line.substr(equals + 1));
  if (!value.empty() && value.find_first_of("\"'[]{}#") == std::string::npos &&
      !toml::parse("v = \"" + value + "\"").empty() && complaint.find("redefine") == std::string_view::npos) {
    return fmt::format("not TOML; text needs quotes: {} = \"{}\"", trimmed(line.substr(0, equals)), value);
  }
  return fmt::format("not TOML: {}", complaint);
}

std::vector<Entry> entries_of(const toml::table& table) {
  std::vector<Entry> entries;
  for (const auto& [key, node] : table) {
    if (const toml::table* section = node.as_table()) {
      for (const auto& [inner, value] : *section)
        entries.push_back({std::string(key.str()), std::string(inner.str()), &value, inner.source().begin.line});
    } else {
      entries.push_back({"", std::string(key.str()), &node, key.source().begin.line});
    }
  }
  // toml++ keeps them by name; the first mistake of the file is reported first.
  std::ranges::stable_sort(entries, {}, &Entry::line);
  return entries;
}

/// The option of a key that a file may set.
const CLI::Option* option_of(const CLI::App& line, const std::string& key) {
  const CLI::Option* const option = line.get_option_no_throw("--" + key);
  const bool is_asked_once = option != nullptr && (option == line.get_help_ptr() || option == line.get_help_all_ptr() ||
                                                   option == line.get_config_ptr() || key == "version");
  return is_asked_once ? nullptr : option;
}

/// A value that a command line has words for; empty for tables, dates and arrays.
std::string text_of(const toml::node& node) {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return fmt::format("{}", number->get());
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  return {};
}

std::vector<std::string> values_of(const CLI::Option& option, const Entry& entry, const std::string& where) {
  const toml::node& node = *entry.value;
  const bool is_flag = option.get_expected_max() == 0;
  const std::string value_name = option.get_type_name();
  std::vector<std::string> texts;
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& item : *array) texts.push_back(text_of(item));
    const bool takes_commas = value_name.find(',') != std::string::npos;
    const bool takes_many = option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
    if (is_flag || texts.empty() || std::ranges::count(texts, "") > 0 || !(takes_commas || takes_many))
      refuse_at(where, fmt::format("found an array, must be {}", is_flag ? "true or false" : value_name));
    if (takes_commas && !takes_many) texts = {fmt::format("{}", fmt::join(texts, ","))};
    return texts;
  }
  const bool is_word = node.is_string() || node.is_number();
  // A flag with a value, as --fill, takes both.
  if (is_flag ? !(node.is_boolean() || (node.is_number() && !value_name.empty())) : !is_word)
    refuse_at(where, fmt::format("found {}, must be {}", node.is_string() ? "text" : text_of(node),
                                 is_flag ? "true or false" : value_name));
  return {text_of(node)};
}

}  // namespace

std::vector<CLI::ConfigItem> TomlConfig::from_config(std::istream& input) const {
  constexpr std::size_t kMostBytes = 1 << 20;
  const std::string path = root_.get_config_ptr()->results().back();
  std::string content(kMostBytes + 1, '\0');
  input.read(content.data(), static_cast<std::streamsize>(content.size()));
  if (input.bad()) refuse_at(path, "cannot be read");
  content.resize(static_cast<std::size_t>(input.gcount()));
  if (content.size() > kMostBytes) refuse_at(path, "is larger than 1 MiB; a file of options is not");
  toml::table table;
  try {
    table = toml::parse(content, path);
  } catch (const toml::parse_error& error) {
    const std::size_t line = error.source().begin.line;
    refuse_at(fmt::format("{}:{}", path, line), why_malformed(content, line, error.description()));
  }

  const std::vector<const CLI::App*> commands = root_.get_subcommands({});
  const CLI::App& own = root_.get_subcommands().empty() ? root_ : *root_.get_subcommands().front();
  // isohf-view is the command view, and knows no other.
  const std::string own_name = own.get_name().substr(own.get_name().find('-') + 1);
  std::vector<CLI::ConfigItem> found;
  const auto take = [&](const Entry& entry, bool is_section) {
    const std::string where = fmt::format("{}:{}: {}", path, entry.line, entry.key);
    for (const CLI::App* line : {&own, &root_}) {
      const CLI::Option* const option = option_of(*line, entry.key);
      if (option == nullptr) continue;
      std::vector<std::string> values = values_of(*option, entry, where);
      // The command line goes before the file, with what it excludes, and the section before the top level.
      const bool has_rival = std::ranges::any_of(option->get_excludes(), [&](const CLI::Option* other) {
        return other->count() > 0 || (!is_section && places_.contains(long_name(*other)));
      });
      if (option->count() > 0 || has_rival || !places_.emplace("--" + entry.key, where).second) return;
      found.push_back(
          {line == &root_ ? std::vector<std::string>{} : std::vector{own.get_name()}, entry.key, std::move(values)});
      return;
    }
  };
  const std::vector<Entry> entries = entries_of(table);
  for (const Entry& entry : entries) {
    const std::string where = fmt::format("{}:{}", path, entry.line);
    const auto section = std::ranges::find(commands, entry.section, &CLI::App::get_name);
    if (entry.section != own_name && section == commands.end() && !entry.section.empty()) {
      std::vector<std::string> names;
      for (const CLI::App* command : commands) names.push_back(command->get_name());
      if (!commands.empty())
        refuse_at(where, fmt::format("no command is called [{}]{}", entry.section, did_you_mean(entry.section, names)));
      continue;
    }
    if (entry.section == own_name) take(entry, true);
    std::vector<const CLI::App*> lines(commands.begin(), commands.end());
    if (!entry.section.empty()) lines = {section == commands.end() ? &own : *section};
    lines.push_back(&root_);
    const bool is_known = std::ranges::any_of(lines, [&](const auto* line) { return option_of(*line, entry.key); });
    // isohf-view alone cannot tell a key of another command from a wrong one.
    if (is_known || (commands.empty() && entry.section.empty())) continue;
    std::vector<std::string> keys;
    for (const std::string& name : long_names(entry.section.empty() ? own : *lines.front(), root_))
      keys.push_back(name.substr(2));
    refuse_at(where,
              fmt::format("{} '{}'{}", entry.section.empty() ? "no option is called" : entry.section + " has no option",
                          entry.key, did_you_mean(entry.key, keys)));
  }
  for (const Entry& entry : entries) {
    if (entry.section.empty()) take(entry, false);
  }
  return found;
}

std::string TomlConfig::place_of(const std::string& option) const {
  const auto place = places_.find(option);
  return place == places_.end() ? option : place->second;
}

}  // namespace isohf::cli
