#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "isohf/raster.h"

namespace isohf {

/// The header of a GRASS ASCII raster (GRASS, r.in.ascii): "north: 4928000", edges of the region, rows:, cols: and,
/// where they are, null:, type: (int, float, double) and multiplier:. Edges may be degrees as in 45:30:00N.
class GrassHeader {
 public:
  /// `path` is for messages.
  explicit GrassHeader(std::string path) : path_(std::move(path)) {}

  /// Whether `word` is the name of a header line, with its colon, perhaps with a value right behind it.
  [[nodiscard]] static bool is_name(std::string_view word);

  /// Takes one line: `name` as is_name has it, without the colon. Throws Error{kCorrupt} where it was given before.
  void add(std::string_view name, std::string_view value, std::uint64_t line);

  /// Size, place, scale and void value into info; the void value is raw, before the multiplier. Throws Error{kCorrupt}.
  void read(SourceInfo& info) const;
  [[nodiscard]] bool is_whole() const;  ///< type: int
  [[nodiscard]] bool has_null() const { return !values_[kNull].text.empty(); }
  /// The raw value of null:; NaN where it is none or no number (then it is a word among the numbers).
  [[nodiscard]] double null_value() const;
  /// The word that means a void; "*" where the header names none.
  [[nodiscard]] std::string_view null_word() const;

 private:
  enum Name : std::size_t { kNorth, kSouth, kEast, kWest, kRows, kCols, kNull, kType, kMultiplier, kNames };
  struct Value {
    std::string text;
    std::uint64_t line = 0;
  };
  [[noreturn]] void refuse(Name name, std::string_view required) const;
  [[nodiscard]] std::int64_t count(Name name) const;
  [[nodiscard]] double edge(Name name, bool& degrees) const;
  static std::size_t find(std::string_view name);

  std::string path_;
  std::array<Value, kNames> values_;
};

}  // namespace isohf
