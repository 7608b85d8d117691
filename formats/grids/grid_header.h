#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// From here on, either side of 0, floats mean voids: they are written with 6 to 17 digits, seldom the same ones twice.
constexpr double kBeyondAnyHeight = 1e38;

/// The words of an ESRI grid header ("ncols 4", "NODATA_value -9999"), in any order; names are compared in lower case
/// without underscores and hyphens.
class GridHeader {
 public:
  /// `path` is for messages.
  explicit GridHeader(std::string path) : path_(std::move(path)) {}

  /// Throws Error{kCorrupt} where the header has `name` already with another value.
  void add(std::string_view name, std::string_view value, std::uint64_t line);

  [[nodiscard]] bool has(std::string_view name) const { return find({name}) != nullptr; }
  /// The value of the first of `names` that there is, lower case names without underscores.
  [[nodiscard]] std::optional<std::string> text(std::initializer_list<std::string_view> names) const;
  /// Throws Error{kCorrupt} naming the line where the value is no number.
  [[nodiscard]] std::optional<double> number(std::initializer_list<std::string_view> names) const;
  /// A whole number of at least `least`. Throws Error{kCorrupt} where the value is none.
  [[nodiscard]] std::optional<std::int64_t> count(std::initializer_list<std::string_view> names,
                                                  std::int64_t least) const;

  /// nrows and ncols, both required, into info.width and info.height.
  void read_size(SourceInfo& info) const;
  /// Spacing and origin into info.georeference: cellsize or dx and dy or xdim and ydim; xllcorner or xllcenter (the
  /// first cell's centre), ulxmap (the upper left cell's centre), each axis by itself. Cells are areas.
  /// Throws Error{kCorrupt}: a spacing that is not positive, two origins of one axis.
  void read_place(SourceInfo& info) const;
  /// The void value into info: from +-1e38 on everything beyond it is void as well, for its digits vary.
  void read_void(SourceInfo& info) const;

  /// Refuses the first word that is none of `names`, all lower case without underscores.
  void require_only(const std::vector<std::string_view>& names) const;

  [[nodiscard]] static std::string plain_name(std::string_view name);

 private:
  struct Word {
    std::string name;
    std::string value;
    std::uint64_t line = 0;
  };
  [[nodiscard]] const Word* find(std::initializer_list<std::string_view> names) const;
  [[noreturn]] void refuse(const Word& word, std::string_view required) const;
  [[nodiscard]] double spacing(std::initializer_list<std::string_view> names) const;
  [[nodiscard]] std::optional<double> first_centre(std::string_view axis, double spacing, std::int64_t count) const;

  std::string path_;
  std::vector<Word> words_;
};

}  // namespace isohf
