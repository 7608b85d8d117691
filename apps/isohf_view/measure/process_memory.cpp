#include "measure/process_memory.h"

#include <fstream>
#include <sstream>
#include <string>

namespace isohf::view {

ProcessMemory process_memory() {
  ProcessMemory memory;
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    std::istringstream fields(line);
    std::string name;
    std::uint64_t kib = 0;
    if (!(fields >> name >> kib)) continue;
    if (name == "RssAnon:") memory.anonymous = kib << 10U;
    if (name == "VmHWM:") memory.peak = kib << 10U;
  }
  return memory;
}

}  // namespace isohf::view
