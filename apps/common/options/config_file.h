#pragma once

#include <string>
#include <vector>

namespace isohf::cli {

/// A value of a TOML file.
struct ConfigValue {
  enum class Kind { kText, kNumber, kBoolean, kArray };

  Kind kind = Kind::kText;
  std::string text;                ///< numbers as an option takes them; empty of an array
  std::vector<ConfigValue> items;  ///< of an array

  /// As a message shows it: '"yes"', 'true', 'an array'.
  [[nodiscard]] std::string shown() const;
};

/// One "key = value" of a TOML file.
struct ConfigEntry {
  std::string section;  ///< empty at the top level
  std::string key;
  ConfigValue value;
  std::string where;  ///< "FILE:LINE"
};

/// The entries of a TOML file: keys at its top level and in its [sections]. Throws Error{kInvalidArgument} that begins
/// with file and line.
[[nodiscard]] std::vector<ConfigEntry> read_config_file(const std::string& path);

}  // namespace isohf::cli
