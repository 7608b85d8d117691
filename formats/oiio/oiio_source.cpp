#include "formats/readers.h"
#include "formats/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "formats/files/file_source.h"
#include "formats/files/foreign_file.h"
#include "formats/georeference/files_beside.h"
#include "formats/oiio/oiio_loader.h"
#include "formats/open_options.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// `why` says what is missing where the module would have been asked.
[[noreturn]] void refuse_unknown(const std::string& path, const std::string& why = {}) {
  const ForeignFile found = foreign_file(path);
  std::string text = path + ": unknown format";
  if (!found.is.empty()) text += ": this is " + found.is;
  text += found.help.empty() ? "; isohf formats lists what is read" : "; " + found.help;
  throw Error(ErrorCode::kUnsupported, why.empty() || !found.help.empty() ? text : text + " (" + why + ")");
}

class OiioSource final : public HeightSource {
 public:
  OiioSource(const IsohfOiioModule& module, const std::string& path, const OpenOptions& options) : module_(module) {
    IsohfOiioInfo found{};
    IsohfOiioMessage message{};
    const int result = module_.open(path.c_str(), options.channel.c_str(), &raster_, &found, &message);
    if (result == ISOHF_OIIO_UNKNOWN) refuse_unknown(path);
    if (result != 0) throw Error(module_error_code(result), fmt::format("{}: {}", path, message.text));
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
      read_place_beside(info_, info_.channel.empty() ? 1 : 0);
      apply_open_options(info_, options);
    } catch (...) {
      module_.close(raster_);
      throw;
    }
  }
  ~OiioSource() override { module_.close(raster_); }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    if (samples.empty()) return;
    IsohfOiioMessage message{};
    const int result = module_.read(raster_, window.column, window.row, window.columns, window.rows, samples.data(),
                                    samples.size(), &message);
    if (result != 0) throw Error(module_error_code(result), fmt::format("{}: {}", info_.path, message.text));
  }

  void limit_buffers(std::uint64_t bytes) override { module_.bound(raster_, signed_bytes(bytes)); }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return static_cast<std::uint64_t>(module_.buffer_bytes(raster_, signed_bytes(limit)));
  }

 private:
  static std::int64_t signed_bytes(std::uint64_t bytes) {
    return static_cast<std::int64_t>(std::min<std::uint64_t>(bytes, INT64_MAX));
  }

  const IsohfOiioModule& module_;
  IsohfOiioRaster* raster_ = nullptr;
  SourceInfo info_;
};

}  // namespace

std::unique_ptr<HeightSource> open_with_oiio(const std::string& path, const OpenOptions& options) {
  const IsohfOiioModule* module = nullptr;
  try {
    module = &oiio_module();
  } catch (const Error& error) {
    refuse_unknown(path, error.what());
  }
  return std::make_unique<OiioSource>(*module, path, options);
}

OiioFormats oiio_formats() {
  const IsohfOiioModule& module = oiio_module();
  OiioFormats formats{module.library(), {}};
  std::istringstream extensions(module.extensions());
  for (std::string extension; extensions >> extension;) formats.extensions.push_back("." + extension);
  return formats;
}

}  // namespace isohf
