#pragma once

#include <string>

namespace isohf {

/// A file that is no raster of ours, by its first bytes.
struct ForeignFile {
  std::string is;    ///< "a PDF document"; empty where it is not known
  std::string help;  ///< what to do with it, naming one command; may be empty
};

[[nodiscard]] ForeignFile foreign_file(const std::string& path);

}  // namespace isohf
