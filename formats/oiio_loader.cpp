#include "formats/oiio_loader.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <mutex>
#include <string>
#include <vector>

#include "formats/registry.h"

namespace isohf {
namespace {

constexpr const char* kModuleFile = "isohf_oiio.so";

/// Where the module is, once loaded.
struct ModuleLoader {
  std::mutex mutex;
  std::string folder;  ///< named by the program; empty: none
  const IsohfOiioModule* module = nullptr;
};

ModuleLoader& loader() {
  static ModuleLoader instance;
  return instance;
}

std::vector<std::filesystem::path> folders(const std::string& named) {
  std::vector<std::filesystem::path> list;
  if (!named.empty()) list.emplace_back(named);
  std::error_code error;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) {
    list.push_back(program.parent_path());
    list.push_back(program.parent_path().parent_path() / "lib" / "isohf");
  }
  return list;
}

const IsohfOiioModule* load_from(const std::filesystem::path& file) {
  void* handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    throw Error(ErrorCode::kUnsupported, fmt::format("the OpenImageIO module cannot be loaded: {}", ::dlerror()));
  }
  using Entry = const IsohfOiioModule* (*)();
  const auto entry = reinterpret_cast<Entry>(::dlsym(handle, ISOHF_OIIO_SYMBOL));
  const IsohfOiioModule* module = entry != nullptr ? entry() : nullptr;
  if (module == nullptr || module->abi != ISOHF_OIIO_ABI) {
    throw Error(ErrorCode::kUnsupported, fmt::format("{} belongs to another version of isohf", file.string()));
  }
  return module;
}

}  // namespace

const IsohfOiioModule& oiio_module() {
  ModuleLoader& state = loader();
  const std::lock_guard lock(state.mutex);
  if (state.module != nullptr) return *state.module;
  std::string searched;
  for (const std::filesystem::path& folder : folders(state.folder)) {
    const std::filesystem::path file = folder / kModuleFile;
    std::error_code error;
    if (std::filesystem::exists(file, error)) {
      state.module = load_from(file);
      return *state.module;
    }
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  throw Error(ErrorCode::kUnsupported, fmt::format("other formats need the OpenImageIO module {} (configure with "
                                                   "ISOHF_BUILD_OIIO_MODULE=ON), which is in none of {}",
                                                   kModuleFile, searched));
}

void set_module_folder(const std::string& folder) {
  ModuleLoader& state = loader();
  const std::lock_guard lock(state.mutex);
  state.folder = folder;
}

}  // namespace isohf
