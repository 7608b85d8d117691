#include "formats/exr/exr_threads.h"

#include <OpenEXR/ImfThreading.h>
#include <OpenEXR/OpenEXRConfig.h>

#include <algorithm>
#include <mutex>
#include <thread>

#include "formats/libraries.h"

namespace isohf {

void start_exr_threads() {
  static std::once_flag once;
  std::call_once(once, [] {
    Imf::setGlobalThreadCount(static_cast<int>(std::clamp(std::thread::hardware_concurrency(), 1U, 4U)));
  });
}

std::string exr_library() {
  return "OpenEXR " OPENEXR_VERSION_STRING;
}

}  // namespace isohf
