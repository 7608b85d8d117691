#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "isohf/raster.h"

namespace isohf {

/// The type A record, with which a USGS DEM begins (USGS, Standards for Digital Elevation Models, part 2, 1998): fields
/// of fixed columns, which the standard counts from 1.
class UsgsDemHeader {
 public:
  /// Of the ground coordinates, by their numbers in the record.
  enum class Unit { kRadian, kFoot, kMetre, kSecond };

  static constexpr std::int64_t kMostPosts = 999999;  ///< a field of six digits
  static constexpr std::int64_t kVoid = -32767;

  /// `path` is for messages. Throws Error{kCorrupt} for a record that is too short.
  UsgsDemHeader(std::string path, std::string text);

  /// Columns, sample type, scale, voids and vertical unit into info.
  /// Throws Error: kCorrupt; kUnsupported for grids that are turned or in radians.
  void read_grid(SourceInfo& info);
  /// The reference system into info, behind read_grid. Throws Error{kCorrupt}.
  void read_system(SourceInfo& info) const;

  // Of the ground coordinates, behind read_grid.
  [[nodiscard]] Unit unit() const { return unit_; }
  [[nodiscard]] double spacing_x() const { return spacing_x_; }
  [[nodiscard]] double spacing_y() const { return spacing_y_; }

 private:
  [[noreturn]] void refuse(const std::string& what) const;
  [[nodiscard]] std::string_view field(std::size_t first, std::size_t size) const;
  [[nodiscard]] std::int64_t whole(std::size_t first, std::size_t size, const char* name, std::int64_t lowest,
                                   std::int64_t highest) const;

  std::string path_;
  std::string text_;
  Unit unit_ = Unit::kMetre;
  double spacing_x_ = 1.0;
  double spacing_y_ = 1.0;
};

}  // namespace isohf
