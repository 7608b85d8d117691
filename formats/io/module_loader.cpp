#include "formats/io/module_loader.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "isohf/raster.h"

namespace isohf {
namespace {

struct Modules {
  std::mutex mutex;
  std::string folder;                          ///< named by the program; empty: none
  std::map<std::string, const void*> by_file;  ///< those that are loaded
};

Modules& modules() {
  static Modules instance;
  return instance;
}

std::vector<std::filesystem::path> module_folders(const std::string& named) {
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

const void* load_from(const std::filesystem::path& file, const ModuleFile& module) {
  void* handle = ::dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (handle == nullptr) {
    throw Error(ErrorCode::kUnsupported, fmt::format("the module {} cannot be loaded: {}", module.file, ::dlerror()));
  }
  using Entry = const void* (*)();
  const auto entry = reinterpret_cast<Entry>(::dlsym(handle, module.symbol));
  const void* const table = entry != nullptr ? entry() : nullptr;
  if (table == nullptr || *static_cast<const std::int32_t*>(table) != module.abi) {
    throw Error(ErrorCode::kUnsupported, fmt::format("{} belongs to another version of isohf", file.string()));
  }
  return table;
}

}  // namespace

const void* load_module(const ModuleFile& module) {
  Modules& state = modules();
  const std::lock_guard lock(state.mutex);
  const void*& table = state.by_file[module.file];
  if (table != nullptr) return table;
  std::string searched;
  for (const std::filesystem::path& folder : module_folders(state.folder)) {
    const std::filesystem::path file = folder / module.file;
    std::error_code error;
    if (std::filesystem::exists(file, error)) return table = load_from(file, module);
    searched += (searched.empty() ? "" : ", ") + folder.string();
  }
  throw Error(ErrorCode::kUnsupported, fmt::format("{} {}, which is in none of {} (a program names its folder by "
                                                   "set_module_folder(); a build without it is configured with {}=ON)",
                                                   module.needed, module.file, searched, module.option));
}

std::string find_beside_program(const std::string& file) {
  Modules& state = modules();
  const std::lock_guard lock(state.mutex);
  for (const std::filesystem::path& folder : module_folders(state.folder)) {
    std::error_code error;
    if (std::filesystem::exists(folder / file, error)) return folder / file;
  }
  return {};
}

void set_module_folder(const std::string& folder) {
  Modules& state = modules();
  const std::lock_guard lock(state.mutex);
  state.folder = folder;
}

}  // namespace isohf
