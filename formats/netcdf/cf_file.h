#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// What a netCDF file says of itself, in whatever way it is stored.
class CfFile {
 public:
  using Value = std::variant<std::string, std::vector<double>>;
  using Attributes = std::map<std::string, Value, std::less<>>;
  struct Dimension {
    std::string name;
    std::uint64_t size = 0;  ///< 0: it grows, and its variables are not read
  };
  /// The external types that netCDF numbers from 1: byte, char, short, int, float, double, ubyte, ushort, uint, int64,
  /// uint64.
  struct Variable {
    std::string name;
    std::vector<std::size_t> dimensions;
    Attributes attributes;
    int type = 0;
    std::uint64_t begin = 0;  ///< of the classic formats: where its samples are

    /// As its samples are delivered; nullopt for characters and all that is no number.
    [[nodiscard]] std::optional<SampleType> sample_type() const;
    [[nodiscard]] std::string text(std::string_view key) const;
    [[nodiscard]] std::span<const double> numbers(std::string_view key) const;  ///< empty where it has none
    [[nodiscard]] std::optional<double> number(std::string_view key) const;     ///< the first of them
  };

  CfFile() = default;
  CfFile(const CfFile&) = delete;
  CfFile& operator=(const CfFile&) = delete;
  virtual ~CfFile() = default;

  [[nodiscard]] const Variable* variable(std::string_view name) const;
  [[nodiscard]] std::uint64_t size_of(const Variable& variable, std::size_t axis) const {
    return dimensions[variable.dimensions[axis]].size;
  }
  /// `count` numbers of a variable of one dimension from the `first` on.
  [[nodiscard]] virtual std::vector<double> numbers(const Variable& variable, std::uint64_t first,
                                                    std::uint64_t count) = 0;

  std::vector<Dimension> dimensions;
  Attributes attributes;
  std::vector<Variable> variables;
};

/// How a variable's samples make a raster.
struct CfRaster {
  const CfFile::Variable* variable = nullptr;
  bool by_columns = false;  ///< its last dimension goes along a column
  bool from_south = false;
};

/// The variable that `options` name, or the first of two dimensions, by the Climate and Forecast conventions: size, type,
/// place, voids and scale into `info`. Throws Error naming info.path.
[[nodiscard]] CfRaster read_cf(CfFile& file, SourceInfo& info, const OpenOptions& options);

}  // namespace isohf
