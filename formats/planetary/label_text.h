#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// What no image has more of, whatever its label says.
constexpr std::int64_t kMostSamples = std::int64_t{1} << 31;  ///< on a side
constexpr std::int64_t kMostBands = 65535;
constexpr double kMostBytes = 1125899906842624.0;  ///< 2^50

/// One value of a label statement: "4.0 <PIXEL/DEGREE>" is text "4.0", unit "PIXEL/DEGREE".
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

/// What stands between OBJECT or GROUP and its end; the whole label is one without a name.
struct LabelBlock {
  std::string name;  ///< upper case
  int line = 0;
  std::vector<LabelEntry> entries;
  std::vector<LabelBlock> blocks;

  /// The first entry of this key (upper case), not those of inner blocks; nullptr where there is none.
  [[nodiscard]] const LabelEntry* entry(std::string_view key) const;
  /// The blocks of this name (upper case) at any depth, in file order.
  [[nodiscard]] std::vector<const LabelBlock*> all(std::string_view block_name) const;
};

/// A parsed label and where its text stops.
struct LabelText {
  LabelBlock root;
  std::uint64_t end_bytes = 0;  ///< behind the line of the END statement
};

/// Parses a label in the Object Description Language of PDS3 (PDS Standards Reference 3.8, chapter 12) or the Parameter
/// Value Language of ISIS: statements, objects and groups, lists, units, comments, up to the END statement.
/// `path` is for messages, which name the line. Throws Error{kCorrupt}: no END, a block without an end, a stray byte.
[[nodiscard]] LabelText parse_label(const std::string& path, std::string_view text);

/// Reads the label that starts the file at `path`, at most 1 MiB of it. Throws as parse_label, and Error{kIo}.
/// unpacked_bytes  as in OpenOptions
[[nodiscard]] LabelText read_label(const std::string& path, std::uint64_t unpacked_bytes);

/// A decimal number or a based integer (16#FF7FFFFB#); nullopt for all else ("N/A", "NULL").
[[nodiscard]] std::optional<double> number_of(const LabelValue& value);

/// The fields of one block, read with messages that name path, line and key. `block` outlives it.
class LabelFields {
 public:
  LabelFields(const std::string& path, const LabelBlock& block) : path_(path), block_(&block) {}

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const LabelBlock& block() const { return *block_; }
  /// The text of a single value; nullopt where the key is absent. Throws Error{kCorrupt} for a list.
  [[nodiscard]] std::optional<std::string> text(std::string_view key) const;
  /// text(), in upper case.
  [[nodiscard]] std::optional<std::string> word(std::string_view key) const;
  /// A finite number, or nullopt where the key is absent or is no number (N/A).
  [[nodiscard]] std::optional<double> number(std::string_view key) const;
  /// The unit of a single value, lower case; empty where there is none.
  [[nodiscard]] std::string unit(std::string_view key) const;
  /// A whole number within [lowest, highest]; `fallback` where the key is absent, which is an error without one.
  [[nodiscard]] std::int64_t count(std::string_view key, std::int64_t lowest, std::int64_t highest,
                                   std::optional<std::int64_t> fallback = std::nullopt) const;
  /// Throws Error{kCorrupt} "path: line N: KEY is ..., must be <required>".
  [[noreturn]] void refuse(std::string_view key, const std::string& required) const;

 private:
  [[nodiscard]] const LabelValue* value(std::string_view key) const;

  std::string path_;
  const LabelBlock* block_;
};

}  // namespace isohf
