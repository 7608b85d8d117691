#include "formats/registry.h"

#include "isohf/base/error.h"

namespace isohf {

const std::vector<Format>& native_formats() {
  static const std::vector<Format> formats = {};
  return formats;
}

std::unique_ptr<HeightSource> open_source(const std::string& path, const OpenOptions& /*options*/) {
  throw Error(ErrorCode::kUnsupported, path + ": no reader is built in");
}

}  // namespace isohf
