#include "options/config_file.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

#include "isohf/error.h"

namespace isohf::cli {
namespace {

[[noreturn]] void refuse_at(const std::string& where, const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, where + ": " + why);
}

std::string content_of(const std::string& path) {
  constexpr std::size_t kMostBytes = 1 << 20;
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse_at("--config: " + path, std::strerror(errno));
  std::string text(kMostBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad()) refuse_at("--config: " + path, "cannot be read");
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > kMostBytes) refuse_at("--config: " + path, "is larger than 1 MiB, which no file of options is");
  return text;
}

std::string trimmed(const std::string& text) {
  const std::size_t from = std::min(text.find_first_not_of(" \t\r"), text.size());
  return text.substr(from, text.find_last_not_of(" \t\r") + 1 - from);
}

bool is_toml(const std::string& value) {
  try {
    (void)toml::parse("value = " + value);
    return true;
  } catch (const toml::parse_error&) {
    return false;
  }
}

/// What a parser's complaint about a line comes down to: mostly, text without quotes.
std::string why_malformed(const std::string& content, std::size_t number, std::string_view complaint) {
  std::istringstream lines(content);
  std::string line;
  for (std::size_t i = 0; i < number; ++i) std::getline(lines, line);
  const std::size_t equals = line.find('=');
  const std::string key = trimmed(line.substr(0, equals));
  const std::string value = equals == std::string::npos ? "" : trimmed(line.substr(equals + 1));
  if (!value.empty() && value.find_first_of("\"'[]{}#") == std::string::npos && !is_toml(value)) {
    return fmt::format("TOML wants text in quotes: {} = \"{}\"", key, value);
  }
  return fmt::format("is no TOML: {}", complaint);
}

ConfigValue value_from(const toml::node& node, const std::string& where) {
  using Kind = ConfigValue::Kind;
  if (const auto* text = node.as_string()) return {Kind::kText, text->get(), {}};
  if (const auto* number = node.as_integer()) return {Kind::kNumber, fmt::format("{}", number->get()), {}};
  if (const auto* number = node.as_floating_point()) return {Kind::kNumber, fmt::format("{}", number->get()), {}};
  if (const auto* flag = node.as_boolean()) return {Kind::kBoolean, flag->get() ? "true" : "false", {}};
  const auto* array = node.as_array();
  if (array == nullptr) refuse_at(where, "is a date, a time or a table, which no option takes");
  ConfigValue value{Kind::kArray, {}, {}};
  for (const toml::node& item : *array) value.items.push_back(value_from(item, where));
  return value;
}

}  // namespace

std::string ConfigValue::shown() const {
  if (kind == Kind::kArray) return "an array";
  return kind == Kind::kText ? "\"" + text + "\"" : text;
}

std::vector<ConfigEntry> read_config_file(const std::string& path) {
  const std::string content = content_of(path);
  toml::table table;
  try {
    table = toml::parse(content, path);
  } catch (const toml::parse_error& error) {
    const std::size_t line = error.source().begin.line;
    refuse_at(fmt::format("{}:{}", path, line), why_malformed(content, line, error.description()));
  }
  std::vector<std::pair<std::size_t, ConfigEntry>> found;
  const auto take = [&](const std::string& section, const toml::key& key, const toml::node& node) {
    const std::size_t line = key.source().begin.line;
    const std::string where = fmt::format("{}:{}", path, line);
    const std::string name(key.str());
    found.push_back({line, {section, name, value_from(node, where + ": " + name), where}});
  };
  for (const auto& [key, node] : table) {
    if (const toml::table* section = node.as_table()) {
      for (const auto& [inner, value] : *section) take(std::string(key.str()), inner, value);
    } else {
      take("", key, node);
    }
  }
  // The parser keeps them by name; what is wrong first in the file is told first.
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<ConfigEntry> entries;
  for (auto& [line, entry] : found) entries.push_back(std::move(entry));
  return entries;
}

}  // namespace isohf::cli
