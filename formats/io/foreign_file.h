#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace isohf {

/// A file that isohf does not read.
struct ForeignFile {
  std::string is;    ///< "a PDF document"; empty where it is not known
  std::string help;  ///< what to do with it, naming one command; may be empty
};

/// By its first bytes, its name and the files beside it.
[[nodiscard]] ForeignFile foreign_file(const std::string& path);

/// Whether a file with this `head` (up to 512 bytes) is a raster that another program converts, as foreign_file() says.
[[nodiscard]] bool is_foreign_raster(const std::string& path, std::span<const std::byte> head);

}  // namespace isohf
