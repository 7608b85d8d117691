#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace isohf {

/// What no image has more of, whatever its label says.
constexpr std::int64_t kMostSamples = std::int64_t{1} << 31;  ///< on a side
constexpr std::int64_t kMostBands = 65535;

/// One value of a label statement: "4.0 <PIXEL/DEGREE>" is text "4.0", unit "pixel/degree".
struct LabelValue {
  std::string text;  ///< without quotes; runs of white space inside quotes are one space
  std::string unit;  ///< lower case, without the angle brackets; empty where there is none
};

/// KEY = value, or KEY = (value, value, ...).
struct LabelEntry {
  std::string key;  ///< upper case, with a leading ^ where the file has one
  std::vector<LabelValue> values;
  int line = 0;  ///< of the key, from 1
};

/// What stands between OBJECT or GROUP and its end; the whole label is one without a name. Keys and names are asked for
/// in upper case. Errors are Error{kCorrupt} and name path, line and key.
struct LabelBlock {
  std::shared_ptr<const std::string> path;  ///< of the label
  std::string name;                         ///< upper case
  int line = 0;
  std::vector<LabelEntry> entries = {};
  std::vector<LabelBlock> blocks = {};

  /// The first entry of this key, not those of inner blocks; nullptr where there is none.
  [[nodiscard]] const LabelEntry* entry(std::string_view key) const;
  /// The blocks of this name at any depth, in file order.
  [[nodiscard]] std::vector<const LabelBlock*> all(std::string_view block_name) const;
  /// The inner block of this name, which must be there.
  [[nodiscard]] const LabelBlock& inner(std::string_view block_name) const;

  /// The text of a single value; nullopt where the key is absent. A list is an error.
  [[nodiscard]] std::optional<std::string> text(std::string_view key) const;
  /// The same in upper case.
  [[nodiscard]] std::string word(std::string_view key, const char* otherwise = "") const;
  /// A finite number; nullopt where the key is absent or is no number ("N/A").
  [[nodiscard]] std::optional<double> number(std::string_view key) const;
  /// A length in metres; `unit` is meant where none stands there, and "km/pixel" counts as km. nullopt for other units.
  [[nodiscard]] std::optional<double> metres(std::string_view key, const char* unit) const;
  /// The unit of a single value, lower case; empty where there is none.
  [[nodiscard]] std::string unit(std::string_view key) const;
  /// A whole number within [lowest, highest]; `otherwise` where the key is absent, which is an error without one.
  [[nodiscard]] std::int64_t count(std::string_view key, std::int64_t lowest, std::int64_t highest,
                                   std::optional<std::int64_t> otherwise = std::nullopt) const;
  /// Throws "path: label line N: KEY is ..., must be <required>".
  [[noreturn]] void refuse(std::string_view key, const std::string& required) const;

 private:
  [[nodiscard]] const LabelValue* value(std::string_view key) const;
};

/// A parsed label and where its text stops.
struct LabelText {
  LabelBlock root;
  std::uint64_t end_bytes = 0;  ///< behind the line of the END statement
};

/// Reads the label that starts the file at `path`, at most 1 MiB of it, in the Object Description Language of PDS3 (PDS
/// Standards Reference 3.8, chapter 12) or the Parameter Value Language of ISIS: statements, objects and groups, lists,
/// units, comments, up to the END statement. Throws Error{kCorrupt}: no END, a block without an end, a stray byte; and
/// Error{kIo}.
[[nodiscard]] LabelText read_label(const std::string& path);

/// A decimal number; nullopt for all else ("N/A", "NULL").
[[nodiscard]] std::optional<double> number_of(const LabelValue& value);

}  // namespace isohf
