#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "formats/format.h"
#include "isohf/raster.h"

namespace isohf {

/// The formats read natively, in the order in which they are tried.
[[nodiscard]] const std::vector<Format>& native_formats();

/// The native format in which open_raster() would read this file; nullptr where none knows it. Throws Error{kIo,
/// kCorrupt} as open_raster does for what is no readable file.
[[nodiscard]] const Format* native_format_of(const std::string& path, const OpenOptions& options);

/// The native format whose signature a file's first 512 bytes hold; nullptr where they hold none.
[[nodiscard]] const Format* format_of_head(std::span<const std::byte> head);

/// What open_raster() opens, as its reader has it, before what is common to all is checked and the system completed.
[[nodiscard]] std::unique_ptr<HeightSource> open_by_content(const std::string& path, const OpenOptions& options);

/// Whether a file has the extension of a format read natively, packed or not.
[[nodiscard]] bool has_raster_extension(const std::string& path);

/// Whether a file of a folder is one of its rasters: by its extension, of archives by the names inside, of .dat by
/// the header beside it. Headers and labels beside images are not.
[[nodiscard]] bool is_raster_in_folder(const std::string& path);

/// "libtiff 4.5.0", or "isohf".
[[nodiscard]] std::string library_of(const Format& format);

/// What the OpenImageIO module brings.
struct OiioFormats {
  std::string library;                  ///< "OpenImageIO 2.4.7"
  std::vector<std::string> extensions;  ///< ".bmp", ...: of all formats that it reads
};

/// Loads the module. Throws Error{kUnsupported} where there is none.
[[nodiscard]] OiioFormats oiio_formats();

}  // namespace isohf
