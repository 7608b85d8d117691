#include "formats/photo/photo.h"
#include "formats/readers.h"
#include "formats/registry.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <vector>

#include "formats/georeference/files_beside.h"
#include "formats/io/file_source.h"
#include "formats/io/foreign_file.h"
#include "formats/module_loader.h"
#include "formats/oiio/oiio_module.h"
#include "formats/open_options.h"
#include "formats/png/packed_elevations.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

/// The OpenImageIO module, as load_module() finds it.
const IsohfOiioModule& oiio_module() {
  return *static_cast<const IsohfOiioModule*>(
      load_module({"isohf_oiio.so", ISOHF_OIIO_SYMBOL, ISOHF_OIIO_ABI, "other formats need the OpenImageIO module",
                   "ISOHF_BUILD_OIIO_MODULE"}));
}

/// `why` says what is missing where the module would have been asked.
[[noreturn]] void refuse_unknown(const std::string& path, const std::string& why = {}) {
  const ForeignFile found = foreign_file(path);
  std::string text = path + ": ";
  if (found.help.empty()) text += found.is.empty() ? "unknown format" : "unknown format: ";
  if (!found.is.empty()) text += "this is " + found.is;
  text += found.help.empty() ? "; isohf formats lists what is read" : "; " + found.help;
  throw Error(ErrorCode::kUnsupported, why.empty() || !found.help.empty() ? text : text + " (" + why + ")");
}

class OiioSource final : public HeightSource {
 public:
  OiioSource(const IsohfOiioModule& module, const std::string& path, const OpenOptions& options) : module_(module) {
    info_.path = path;
    try {
      packing_ = packing_from_string(options.channel);
      std::string channel = options.channel;
      if (channel.empty()) channel = decide_on_colours();
      const std::string warning = open(packing_ ? ISOHF_OIIO_ALL_CHANNELS : channel);
      if (!warning.empty()) info_.warnings.push_back(warning);
      read_place_beside(info_, info_.channel.empty() ? 1 : 0);
      if (packing_) place_web_tile(info_);
      apply_open_options(info_, options);
    } catch (...) {
      close();
      throw;
    }
  }
  ~OiioSource() override { close(); }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    ISOHF_ASSERT(is_window_of(info_, window, samples.size()));
    if (samples.empty()) return;
    if (!packing_) return read(window, samples);
    unpack_elevations(*packing_, channels_, read_pixels(window), samples);
  }

  void limit_buffers(std::uint64_t bytes) override { module_.bound(raster_, signed_bytes(bytes)); }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return static_cast<std::uint64_t>(module_.buffer_bytes(raster_, signed_bytes(limit)));
  }

 private:
  /// Opens the channel, or all of them; returns what is to be said of that.
  std::string open(const std::string& channel) {
    close();
    IsohfOiioInfo found{};
    IsohfOiioMessage message{};
    const int result = module_.open(info_.path.c_str(), channel.c_str(), &raster_, &found, &message);
    if (result == ISOHF_OIIO_UNKNOWN) refuse_unknown(info_.path);
    if (result != 0) throw Error(module_error_code(result), fmt::format("{}: {}", info_.path, message.text));
    info_.format = found.format;
    info_.width = found.width;
    info_.height = found.height;
    info_.block_width = found.block_width;
    info_.block_height = found.block_height;
    info_.sample_type = static_cast<SampleType>(found.sample_type);
    info_.channel = found.channel;
    channels_ = static_cast<std::size_t>(found.channels);
    if (packing_) describe_packing(*packing_, channels_, static_cast<int>(8 * size_bytes(info_.sample_type)), info_);
    return found.warning;
  }

  void close() {
    if (raster_ != nullptr) module_.close(raster_);
    raster_ = nullptr;
  }

  void read(const Window& window, std::span<std::byte> samples) {
    IsohfOiioMessage message{};
    const int result = module_.read(raster_, window.column, window.row, window.columns, window.rows, samples.data(),
                                    samples.size(), &message);
    if (result != 0) throw Error(module_error_code(result), fmt::format("{}: {}", info_.path, message.text));
  }

  /// Of all channels, 8 bits each.
  std::span<const std::byte> read_pixels(const Window& window) {
    pixels_.resize(static_cast<std::size_t>(window.columns * window.rows) * channels_);
    read(window, pixels_);
    return pixels_;
  }

  /// What a picture of red, green and blue, and maybe opacity, holds; returns the channel to read where that is one.
  std::string decide_on_colours() {
    (void)open(ISOHF_OIIO_ALL_CHANNELS);
    if ((channels_ != 3 && channels_ != 4) || is_floating(info_.sample_type)) return {};
    PackingEvidence evidence(channels_);
    if (info_.sample_type == SampleType::kUint8) {
      const std::int64_t rows = std::min<std::int64_t>(PackingEvidence::kRows, info_.height);
      const std::span<const std::byte> pixels = read_pixels({0, 0, info_.width, rows});
      const std::size_t row_bytes = pixels.size() / static_cast<std::size_t>(rows);
      for (std::size_t at = 0; at < pixels.size(); at += row_bytes) evidence.add(pixels.subspan(at, row_bytes));
    }
    packing_ = evidence.decide(channels_ == 3 ? "R, G, B" : "R, G, B, A", info_);
    return "0";
  }

  static std::int64_t signed_bytes(std::uint64_t bytes) {
    return static_cast<std::int64_t>(std::min<std::uint64_t>(bytes, INT64_MAX));
  }

  const IsohfOiioModule& module_;
  IsohfOiioRaster* raster_ = nullptr;
  SourceInfo info_;
  std::size_t channels_ = 1;  ///< that are read
  std::optional<Packing> packing_;
  std::vector<std::byte> pixels_;  ///< of all channels
};

class OiioRows final : public PhotoRows {
 public:
  explicit OiioRows(PhotoInfo& info) : module_(oiio_module()) {
    IsohfOiioInfo found{};
    IsohfOiioMessage message{};
    const int result = module_.open(info.path.c_str(), ISOHF_OIIO_PHOTO, &raster_, &found, &message);
    if (result == ISOHF_OIIO_UNKNOWN) {
      throw Error(ErrorCode::kUnsupported, "is no picture of a format that isohf knows; PNG, JPEG or TIFF is best");
    }
    if (result != 0) throw Error(module_error_code(result), message.text);
    try {
      describe(found, info);
    } catch (...) {
      module_.close(raster_);
      throw;
    }
  }
  ~OiioRows() override { module_.close(raster_); }

  void read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) override {
    raw_.resize(static_cast<std::size_t>(width_ * rows * stored_) * size_bytes(type_));
    IsohfOiioMessage message{};
    const int result = module_.read(raster_, 0, row, width_, rows, raw_.data(), raw_.size(), &message);
    if (result != 0) throw Error(module_error_code(result), message.text);
    photo_samples(type_, raw_, stored_, kept_, is_light_, samples);
  }

 private:
  void describe(const IsohfOiioInfo& found, PhotoInfo& info) {
    info.format = found.format;
    info.width = found.width;
    info.height = found.height;
    type_ = static_cast<SampleType>(found.sample_type);
    if (type_ != SampleType::kUint8 && type_ != SampleType::kUint16 && type_ != SampleType::kFloat16 &&
        type_ != SampleType::kFloat32) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("has samples of {}; store it as PNG, JPEG or TIFF of 8 bits", to_string(type_)));
    }
    width_ = found.width;
    stored_ = found.channels;
    kept_ = info.channels = photo_channels(stored_, found.alpha, info);
    is_light_ = found.is_linear != 0;
    info.random_access = found.block_width < found.width;
    info.block_height =
        std::min(std::max<std::int64_t>(info.block_height / found.block_height, 1) * found.block_height, found.height);
    if (found.warning[0] != '\0') info.warnings.push_back(fmt::format("{}: {}", info.path, found.warning));
  }

  const IsohfOiioModule& module_;
  IsohfOiioRaster* raster_ = nullptr;
  SampleType type_ = SampleType::kUint8;
  std::int64_t width_ = 0;
  int stored_ = 0;
  int kept_ = 0;
  bool is_light_ = false;
  std::vector<std::byte> raw_;
};

}  // namespace

std::unique_ptr<HeightSource> open_with_oiio(const std::string& path, const OpenOptions& options) {
  if (!foreign_file(path).help.empty()) refuse_unknown(path);
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
  for (std::string extension; extensions >> extension;) {
    if (extension != "jp2" && extension != "j2k" && extension != "j2c") formats.extensions.push_back("." + extension);
  }
  return formats;
}

std::unique_ptr<PhotoRows> open_oiio_rows(PhotoInfo& info) {
  if (const ForeignFile found = foreign_file(info.path); !found.help.empty()) {
    throw Error(ErrorCode::kUnsupported, "this is " + found.is + "; " + found.help);
  }
  return std::make_unique<OiioRows>(info);
}

}  // namespace isohf
