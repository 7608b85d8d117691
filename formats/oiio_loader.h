#pragma once

#include "formats/oiio_module.h"
#include "isohf/base/error.h"

namespace isohf {

/// The OpenImageIO module isohf_oiio.so, loaded at the first call; it stays loaded until the program ends. It is looked
/// for in the folder that set_module_folder named, beside the running program, and in ../lib/isohf seen from there.
/// Throws Error{kUnsupported} where there is none, or it is another version's.
[[nodiscard]] const IsohfOiioModule& oiio_module();

/// The code of a result other than 0 of the module's functions.
[[nodiscard]] inline ErrorCode oiio_error_code(int result) {
  return static_cast<ErrorCode>(result - 1);
}

}  // namespace isohf
