#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "isohf/raster.h"

namespace isohf {

/// The words of an ESRI grid header ("ncols 4", "NODATA_value -9999"), in any order. Names are compared by plain_name().
class GridHeader {
 public:
  /// `path` is for messages.
  explicit GridHeader(std::string path) : path_(std::move(path)) {}

  /// In lower case, without underscores and hyphens, and one for all that mean the same: "xdim" is "dx".
  [[nodiscard]] static std::string plain_name(std::string_view name);

  /// Throws Error{kCorrupt} if the header has `name` already with another value.
  void add(std::string_view name, std::string_view value, std::uint64_t line);
  /// Refuses the first word whose plain name is none of `names`.
  void require_only(std::span<const std::string_view> names) const;

  [[nodiscard]] bool has(std::string_view name) const { return find(name) != nullptr; }
  /// The value in lower case.
  [[nodiscard]] std::optional<std::string> text(std::string_view name) const;
  /// A whole number of at least `least`. Throws Error{kCorrupt} naming the line if the value is none.
  [[nodiscard]] std::optional<std::int64_t> count(std::string_view name, std::int64_t least) const;

  /// nrows and ncols, both required, into info.width and info.height.
  void read_size(SourceInfo& info) const;
  /// Spacing and origin into info.georeference: cellsize or dx and dy; xllcorner or xllcenter (the first cell's centre),
  /// ulxmap (the upper left cell's centre), each axis by itself. Cells are areas.
  /// Throws Error{kCorrupt}: a spacing that is not positive, two origins of one axis.
  void read_place(SourceInfo& info) const;
  /// The nodata value into info. Beyond 1e30 its digits vary, and everything beyond is nodata as well.
  void read_nodata(SourceInfo& info) const;

 private:
  struct Word {
    std::string name;  ///< as it is spelled
    std::string value;
    std::uint64_t line = 0;
  };
  [[nodiscard]] const Word* find(std::string_view name) const;
  [[noreturn]] void refuse(const Word& word, std::string_view required) const;
  [[nodiscard]] double number(const Word& word) const;
  /// 0 if there is no such word.
  [[nodiscard]] double spacing(std::string_view name) const;
  [[nodiscard]] std::optional<double> origin(char axis, double spacing, std::int64_t count) const;

  std::string path_;
  std::map<std::string, Word, std::less<>> words_;  ///< by plain name
};

}  // namespace isohf
