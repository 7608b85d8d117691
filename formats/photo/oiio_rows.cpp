#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "formats/oiio/oiio_loader.h"
#include "formats/photo/photo.h"
#include "isohf/error.h"

namespace isohf {
namespace {

class OiioRows final : public PhotoRows {
 public:
  explicit OiioRows(PhotoInfo& info) : module_(oiio_module()) {
    IsohfOiioInfo found{};
    IsohfOiioMessage message{};
    const int result = module_.open(info.path.c_str(), ISOHF_OIIO_ALL_CHANNELS, &raster_, &found, &message);
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

std::unique_ptr<PhotoRows> open_oiio_rows(PhotoInfo& info) {
  return std::make_unique<OiioRows>(info);
}

}  // namespace isohf
