#pragma once

#include <memory>
#include <string>

#include "isohf/raster.h"

namespace isohf {

/// Opens a raster through OpenImageIO, which lies in the module isohf_oiio.so and is loaded at the first call. The
/// module is looked for in the folder that set_module_folder named, beside the running program, and in ../lib/isohf
/// seen from there.
/// Throws Error{kUnsupported} naming the path, with the formats read natively, where there is no module or it knows the
/// file no better; kCorrupt, kInvalidArgument and kOutOfMemory as other readers.
[[nodiscard]] std::unique_ptr<HeightSource> open_with_oiio(const std::string& path, const OpenOptions& options);

}  // namespace isohf
