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

/// The words of a value on a command line; empty for a table, a date and an array.
std::string text_of(const toml::node& node) {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return fmt::format("{}", number->get());
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  return {};
}

std::vector<std::string> values_of(const CLI::Option& option, const Entry& entry, const std::string& where) {
  const toml::node& node = *entry.value;
  const std::string value_name = option.get_type_name();
  const bool is_flag = option.get_expected_max() == 0;
  const bool takes_many = option.get_multi_option_policy() == CLI::MultiOptionPolicy::TakeAll;
  const std::string required = is_flag ? "true or false" : value_name;
  if (const toml::array* array = node.as_array()) {
    std::vector<std::string> texts;
    for (const toml::node& item : *array) texts.push_back(text_of(item));
    if (texts.empty() || std::ranges::count(texts, "") > 0 ||
        (!takes_many && value_name.find(',') == std::string::npos))
      refuse_at(where, "found an array, must be " + required);
    return takes_many ? texts : std::vector{fmt::format("{}", fmt::join(texts, ","))};
  }
  // A flag with a value, as --fill, takes both.
  const bool fits =
      is_flag ? node.is_boolean() || (node.is_number() && !value_name.empty()) : node.is_string() || node.is_number();
  if (!fits) refuse_at(where, fmt::format("found '{}', must be {}", text_of(node), required));
  return {text_of(node)};
}

toml::table read_file(std::istream& input, const std::string& path) {
  try {
    return toml::parse(input, path);
  } catch (const toml::parse_error& error) {
    refuse_at(fmt::format("{}:{}", path, error.source().begin.line),
              fmt::format("not TOML: {} (text needs quotes, as in type = \"u8\")", error.description()));
  }
}

/// Refuses a key that no command has, or not that of its section.
void check(const Entry& entry, const std::string& where, const CLI::App& root, const CLI::App& own,
           const std::string& own_name) {
  // isohf-view has no other commands: it passes over what may be theirs. So does isohf over what is isohf-view's.
  const auto commands = root.get_subcommands([](const CLI::App*) { return true; });
  if (commands.empty() && entry.section != own_name) return;
  std::vector<const CLI::App*> lines(commands.begin(), commands.end());
  if (!entry.section.empty()) std::erase_if(lines, [&](const auto* line) { return line->get_name() != entry.section; });
  if (commands.empty()) lines = {&own};
  if (lines.empty()) {
    std::vector<std::string> names;
    for (const CLI::App* command : commands) names.push_back(command->get_name());
    refuse_at(where, fmt::format("no command is called [{}]{}", entry.section, did_you_mean(entry.section, names)));
  }
  const CLI::App& line = entry.section.empty() ? own : *lines.front();
  if (line.get_options().empty()) return;
  lines.push_back(&root);
  if (std::ranges::any_of(lines, [&](const auto* any) { return option_of(*any, entry.key) != nullptr; })) return;
  refuse_at(where,
            fmt::format("{} '{}'{}", entry.section.empty() ? "no option is called" : entry.section + " has no option",
                        entry.key, did_you_mean("--" + entry.key, long_names(line, root))));
}

}  // namespace

std::vector<CLI::ConfigItem> TomlConfig::from_config(std::istream& input) const {
  const std::string path = root_.get_config_ptr()->results().back();
  const toml::table table = read_file(input, path);
  const CLI::App& own = root_.get_subcommands().empty() ? root_ : *root_.get_subcommands().front();
  // isohf-view is the command view.
  const std::string own_name = own.get_name().substr(own.get_name().find('-') + 1);
  const std::vector<Entry> entries = entries_of(table);
  for (const Entry& entry : entries) check(entry, fmt::format("{}:{}", path, entry.line), root_, own, own_name);
  std::vector<CLI::ConfigItem> found;
  for (const bool is_section : {true, false}) {
    const std::map<std::string, std::string> of_section = places_;
    for (const Entry& entry : entries) {
      if (entry.section != (is_section ? own_name : "")) continue;
      const bool is_own = option_of(own, entry.key) != nullptr;
      const CLI::Option* const option = option_of(is_own ? own : root_, entry.key);
      if (option == nullptr) continue;
      const std::string where = fmt::format("{}:{}: {}", path, entry.line, entry.key);
      std::vector<std::string> values = values_of(*option, entry, where);
      // The command line goes before the file, with what it excludes, and the section before the top level.
      const bool has_rival = std::ranges::any_of(option->get_excludes(), [&](const CLI::Option* other) {
        return other->count() > 0 || of_section.contains(long_name(*other));
      });
      if (option->count() > 0 || has_rival || !places_.emplace("--" + entry.key, where).second) continue;
      const bool is_root = !is_own || &own == &root_;
      found.push_back(
          {is_root ? std::vector<std::string>{} : std::vector{own.get_name()}, entry.key, std::move(values)});
    }
  }
  return found;
}

std::string TomlConfig::place_of(const std::string& option) const {
  const auto place = places_.find(option);
  return place == places_.end() ? option : place->second;
}

}  // namespace isohf::cli
