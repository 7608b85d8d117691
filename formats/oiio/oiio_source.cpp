#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "formats/georeference/sidecars.h"
#include "formats/io/foreign_file.h"
#include "formats/io/module_loader.h"
#include "formats/oiio/oiio_plugin.h"
#include "formats/open_options.h"
#include "formats/photo/photo.h"
#include "formats/png/png_decoder.h"
#include "formats/readers.h"
#include "formats/registry.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

const OiioPlugin& oiio_plugin() {
  return *static_cast<const OiioPlugin*>(
      load_module({"isohf_oiio.so", kOiioSymbol, kOiioAbi, "other formats need the OpenImageIO module",
                   "ISOHF_BUILD_OIIO_MODULE"}));
}

/// Throws that nothing reads the file; `why` tells what is missing to try OpenImageIO.
[[noreturn]] void refuse_unknown(const std::string& path, const std::string& why = {}) {
  const ForeignFile found = foreign_file(path);
  std::string text = found.is.empty() ? "unknown format" : "this is " + found.is;
  if (!found.is.empty() && found.help.empty()) text = "unknown format: " + text;
  text += "; " + (found.help.empty() ? "isohf formats lists what is read" : found.help);
  throw Error(ErrorCode::kUnsupported, why.empty() || !found.help.empty() ? text : fmt::format("{} ({})", text, why));
}

std::unique_ptr<OiioPicture> open_picture(const std::string& path, OiioPlugin::For use, const std::string& channel = {},
                                          const std::function<void(SourceInfo& info)>& complete = {}) {
  if (!foreign_file(path).help.empty()) refuse_unknown(path);
  const OiioPlugin* plugin = nullptr;
  try {
    plugin = &oiio_plugin();
  } catch (const Error& error) {
    refuse_unknown(path, error.what());
  }
  std::unique_ptr<OiioPicture> picture = plugin->open(path, use, channel, complete);
  if (picture == nullptr) refuse_unknown(path);
  return picture;
}

class OiioRows final : public PhotoRows {
 public:
  explicit OiioRows(PhotoInfo& info) : picture_(open_picture(info.path, OiioPlugin::For::kPhoto)) {
    const SourceInfo& found = picture_->info();
    info.format = found.format;
    info.width = found.width;
    info.height = found.height;
    const SampleType type = found.sample_type;
    if (type != SampleType::kUint8 && type != SampleType::kUint16 && type != SampleType::kFloat16 &&
        type != SampleType::kFloat32) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("has samples of {}; store it as PNG, JPEG or TIFF of 8 bits", to_string(type)));
    }
    kept_ = info.channels = photo_channels(picture_->channels, picture_->alpha, info);
    info.random_access = found.block_width < found.width;
    read_whole_blocks(found.block_height, info);
  }

  void read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) override {
    const SourceInfo& info = picture_->info();
    raw_.resize(static_cast<std::size_t>(info.width * rows * picture_->channels) * size_bytes(info.sample_type));
    picture_->read_pixels(row, rows, raw_.data());
    photo_samples(info.sample_type, raw_, picture_->channels, kept_, picture_->is_linear, samples);
  }

 private:
  std::unique_ptr<OiioPicture> picture_;
  int kept_ = 0;
  std::vector<std::byte> raw_;
};

}  // namespace

std::unique_ptr<HeightSource> open_with_oiio(const std::string& path, const OpenOptions& options) try {
  if (!options.encoding.empty()) {
    throw Error(ErrorCode::kUnsupported, "packed elevations are read in PNG, WebP and TIFF; store it as one of these");
  }
  return open_picture(path, OiioPlugin::For::kNumbers, options.channel, [&](SourceInfo& info) {
    read_sidecars(info, info.channel.empty() ? 1 : 0);
    apply_open_options(info, options);
  });
} catch (const Error& error) {
  throw naming(path, error);
}

OiioFormats oiio_formats() {
  const OiioPlugin& plugin = oiio_plugin();
  OiioFormats formats{plugin.library(), plugin.extensions()};
  std::erase_if(formats.extensions, [](const std::string& name) { return name.starts_with(".j2") || name == ".jp2"; });
  return formats;
}

std::unique_ptr<PhotoRows> open_oiio_rows(PhotoInfo& info) {
  return std::make_unique<OiioRows>(info);
}

}  // namespace isohf
