#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace isohf {

/// A tile that a raster was cut into: STEM_xCOLUMN_yROW.EXT, x counted eastwards and y southwards from 0.
struct TileName {
  std::string stem;  ///< with its folder
  std::int64_t column = 0;
  std::int64_t row = 0;
  std::string extension;  ///< ".r16"

  /// nullopt for a file of another name.
  [[nodiscard]] static std::optional<TileName> of(const std::string& path);
  [[nodiscard]] std::string path() const;
};

}  // namespace isohf
