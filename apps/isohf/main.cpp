/// isohf: elevation rasters to isometric heightfield archives.

#include <malloc.h>

#include <cstdlib>

#include "commands/command.h"
#include "formats/registry.h"

namespace {

/// Keeps freed memory in the process. Tiles come and go by the thousand, a few hundred kilobytes each; the system would
/// clear every page of each anew, a quarter of the time that large inputs take.
void keep_freed_memory() {
#if defined(__GLIBC__)
  constexpr int kMappedFrom = 4 << 20;
  constexpr int kKept = 256 << 20;
  ::mallopt(M_MMAP_THRESHOLD, kMappedFrom);
  ::mallopt(M_TRIM_THRESHOLD, kKept);
#endif
}

}  // namespace

int main(int argc, char** argv) {
  keep_freed_memory();
  if (const char* folder = std::getenv("ISOHF_MODULE_PATH"); folder != nullptr) isohf::set_module_folder(folder);
  return isohf::cli::run_main(isohf::cli::kIsohf, argc, argv);
}
