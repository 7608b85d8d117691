#pragma once

#include "formats/module_loader.h"
#include "formats/oiio/oiio_module.h"

namespace isohf {

/// The OpenImageIO module, as load_module() finds it.
[[nodiscard]] inline const IsohfOiioModule& oiio_module() {
  return *static_cast<const IsohfOiioModule*>(
      load_module({"isohf_oiio.so", ISOHF_OIIO_SYMBOL, ISOHF_OIIO_ABI, "other formats need the OpenImageIO module",
                   "ISOHF_BUILD_OIIO_MODULE"}));
}

}  // namespace isohf
