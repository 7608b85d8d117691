#pragma once

#include <optional>
#include <string>

namespace isohf {

/// The South-West post of an SRTM tile, whole degrees.
struct HgtCorner {
  int longitude = 0;  ///< -180...180
  int latitude = 0;   ///< -90...90
};

/// What the name of an SRTM tile says: hemisphere and two digits, hemisphere and three digits, in any case, at its
/// beginning: "N44E006.hgt", "s35e145.SRTMGL1.hgt.zip". Nothing where it begins in another way. Folders may precede it.
[[nodiscard]] std::optional<HgtCorner> hgt_corner_of(const std::string& path);

}  // namespace isohf
