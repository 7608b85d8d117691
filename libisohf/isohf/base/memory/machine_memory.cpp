#include "isohf/base/memory/machine_memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

namespace isohf {
namespace {

constexpr std::uint64_t kNoLimit = UINT64_MAX;

/// The number in a control file; kNoLimit if there is none ("max", or no such file).
std::uint64_t limit_in(const std::filesystem::path& file) {
  std::ifstream stream(file);
  std::uint64_t limit = kNoLimit;
  return stream >> limit ? limit : kNoLimit;
}

/// The least limit of a group and of all that it belongs to. In a container the group's own folder may be out of sight,
/// and the mount is that of the container.
std::uint64_t least_limit(const std::filesystem::path& mount, std::filesystem::path group, const char* file) {
  std::uint64_t least = limit_in(mount / file);
  for (; group.has_relative_path(); group = group.parent_path())
    least = std::min(least, limit_in(mount / group.relative_path() / file));
  return least;
}

/// Of versions 1 and 2: lines such as "4:memory:/a/b" and "0::/a/b".
std::uint64_t control_group_limit() {
  std::uint64_t least = kNoLimit;
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t name = line.find(':') + 1;
    const std::size_t path = line.find(':', name) + 1;
    if (name == 0 || path == 0) continue;
    const std::string controllers = "," + line.substr(name, path - name - 1) + ",";
    if (controllers == ",,") {
      least = std::min(least, least_limit("/sys/fs/cgroup", line.substr(path), "memory.max"));
    } else if (controllers.find(",memory,") != std::string::npos) {
      least = std::min(least, least_limit("/sys/fs/cgroup/memory", line.substr(path), "memory.limit_in_bytes"));
    }
  }
  return least;
}

}  // namespace

std::uint64_t machine_memory_bytes() {
  static const std::uint64_t least = [] {
    std::uint64_t found = control_group_limit();
    const long pages = ::sysconf(_SC_PHYS_PAGES);
    const long page_bytes = ::sysconf(_SC_PAGESIZE);
    if (pages > 0 && page_bytes > 0)
      found = std::min(found, static_cast<std::uint64_t>(pages) * static_cast<std::uint64_t>(page_bytes));
    for (const auto resource : {RLIMIT_AS, RLIMIT_DATA}) {
      struct rlimit limit {};
      if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        found = std::min(found, static_cast<std::uint64_t>(limit.rlim_cur));
    }
    return found == kNoLimit ? 0 : found;
  }();
  return least;
}

}  // namespace isohf
