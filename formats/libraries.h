#pragma once

#include <string>
#include <vector>

namespace isohf {

/// Name and version of the libraries that formats are read and written with, as they run: "libtiff 4.5.0". Each is
/// defined in the source file that holds the library's headers.
[[nodiscard]] std::string exr_library();
[[nodiscard]] std::string png_library();
[[nodiscard]] std::string tiff_library();

/// What the OpenImageIO module brings.
struct OiioFormats {
  std::string library;                  ///< "OpenImageIO 2.4.7"
  std::vector<std::string> extensions;  ///< ".bmp", ...: of all formats that it reads
};

/// Loads the module. Throws Error{kUnsupported} where there is none.
[[nodiscard]] OiioFormats oiio_formats();

}  // namespace isohf
