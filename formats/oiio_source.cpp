#include "formats/oiio_source.h"

#include <dlfcn.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <mutex>
#include <vector>

#include "formats/oiio_module.h"
#include "formats/open_options.h"
#include "isohf/base/assert.h"
#include "isohf/base/error.h"

namespace isohf {
namespace {

constexpr const char* kModuleFile = "isohf_oiio.so";

/// Where the module is, once loaded; it stays loaded until the program ends.
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

const IsohfOiioModule& loaded_module() {
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

/// The module's result codes are ErrorCode plus one, zero for success.
ErrorCode error_code(int result) {
  return static_cast<ErrorCode>(result - 1);
}

std::string native_names() {
  std::string names;
  for (const Format& format : native_formats()) {
    names += fmt::format("{}{} ({})", names.empty() ? "" : ", ", format.name, fmt::join(format.extensions, " "));
  }
  return names;
}

class OiioSource final : public HeightSource {
 public:
  OiioSource(const IsohfOiioModule& module, const std::string& path, const OpenOptions& options) : module_(module) {
    IsohfOiioInfo found{};
    IsohfOiioMessage message{};
    const int result = module_.open(path.c_str(), options.channel.c_str(), &raster_, &found, &message);
    if (result != 0) throw Error(error_code(result), message.text);
    info_.path = path;
    info_.format = found.format;
    info_.width = found.width;
    info_.height = found.height;
    info_.block_width = found.block_width;
    info_.block_height = found.block_height;
    info_.sample_type = static_cast<SampleType>(found.sample_type);
    info_.channel = found.channel;
    if (found.warning[0] != '\0') info_.warnings.emplace_back(found.warning);
    try {
      apply_open_options(info_, options);
    } catch (...) {
      module_.close(raster_);
      throw;
    }
  }
  ~OiioSource() override { module_.close(raster_); }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(window.column >= 0 && window.row >= 0 && window.columns >= 0 && window.rows >= 0 &&
                 window.column + window.columns <= info_.width && window.row + window.rows <= info_.height);
    ISOHF_ASSERT(samples.size() ==
                 static_cast<std::size_t>(window.columns * window.rows) * size_bytes(info_.sample_type));
    if (samples.empty()) return;
    IsohfOiioMessage message{};
    const int result = module_.read(raster_, window.column, window.row, window.columns, window.rows, samples.data(),
                                    samples.size(), &message);
    if (result != 0) throw Error(error_code(result), fmt::format("{}: {}", info_.path, message.text));
  }

 private:
  const IsohfOiioModule& module_;
  IsohfOiioRaster* raster_ = nullptr;
  SourceInfo info_;
};

}  // namespace

void set_module_folder(const std::string& folder) {
  ModuleLoader& state = loader();
  const std::lock_guard lock(state.mutex);
  state.folder = folder;
}

std::unique_ptr<HeightSource> open_with_oiio(const std::string& path, const OpenOptions& options) {
  try {
    return std::make_unique<OiioSource>(loaded_module(), path, options);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kUnsupported) throw error.within(path);
    throw Error(error.code(),
                fmt::format("{}: unknown format; read natively: {}; {}", path, native_names(), error.what()));
  }
}

}  // namespace isohf
