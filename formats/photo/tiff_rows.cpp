#include <fmt/format.h>
#include <tiff.h>

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "formats/geotiff/geotiff_keys.h"
#include "formats/geotiff/tiff_blocks.h"
#include "formats/geotiff/tiff_file.h"
#include "formats/photo/photo.h"
#include "isohf/error.h"

namespace isohf {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::kUnsupported,
              what +
                  "; photos have 8 or 16 bits or floats, grey, RGB or of a palette: gdal_translate -ot Byte makes "
                  "such of others");
}

SampleType sample_type_of(const TiffLayout& layout) {
  const bool is_unsigned = layout.sample_format == SAMPLEFORMAT_UINT || layout.sample_format == SAMPLEFORMAT_VOID;
  const int bits = layout.bits_per_sample;
  if (is_unsigned && bits == 8) return SampleType::kUint8;
  if (is_unsigned && bits == 16) return SampleType::kUint16;
  if (layout.sample_format == SAMPLEFORMAT_IEEEFP && bits == 16) return SampleType::kFloat16;
  if (layout.sample_format == SAMPLEFORMAT_IEEEFP && bits == 32) return SampleType::kFloat32;
  refuse(fmt::format("has {} samples of {} bits",
                     is_unsigned                                   ? "unsigned"
                     : layout.sample_format == SAMPLEFORMAT_IEEEFP ? "floating"
                                                                   : "signed or complex",
                     bits));
}

class TiffRows final : public PhotoRows {
 public:
  explicit TiffRows(PhotoInfo& info) {
    TiffMainImage image = open_main_image(info.path);
    const TiffLayout layout = image.handle->read_layout();
    describe(*image.handle, layout, info);
    info.random_access = layout.tiled || layout.block_height < layout.height;
    read_whole_blocks(layout.block_height, info);
    width_ = layout.width;
    constexpr std::uint64_t kNoCache = 0;  // whole rows of blocks are read
    blocks_.emplace(info.path, layout, std::move(image), TiffBlocks::kAllSamples, kNoCache);
  }

  void read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) override {
    raw_.resize(static_cast<std::size_t>(width_ * stored_ * rows) * size_bytes(type_));
    blocks_->read({0, row, width_, rows}, raw_);
    if (!palette_.empty()) {
      for (std::size_t i = 0; i < raw_.size(); ++i) {
        std::ranges::copy(palette_[std::to_integer<std::size_t>(raw_[i])],
                          samples.begin() + static_cast<std::ptrdiff_t>(3 * i));
      }
      return;
    }
    photo_samples(type_, raw_, stored_, kept_, false, samples);
    if (!inverted_) return;
    for (std::uint8_t& sample : samples) sample = static_cast<std::uint8_t>(255 - sample);
  }

 private:
  void describe(TiffHandle& handle, const TiffLayout& layout, PhotoInfo& info) {
    info.format = "tiff";
    info.width = layout.width;
    info.height = layout.height;
    stored_ = layout.samples_per_pixel;
    inverted_ = layout.photometric == PHOTOMETRIC_MINISWHITE;
    if (layout.photometric == PHOTOMETRIC_PALETTE) {
      if (stored_ != 1 || layout.bits_per_sample != 8) {
        refuse(fmt::format("has a palette for {} samples of {} bits", stored_, layout.bits_per_sample));
      }
      palette_ = handle.read_palette();
    }
    const bool is_read = !palette_.empty() || layout.is_grey() || layout.is_colour();
    kept_ = photo_channels(stored_, layout.alpha_sample, info);
    if (!is_read) refuse(fmt::format("has colours of TIFF's photometric interpretation {}", layout.photometric));
    type_ = sample_type_of(layout);
    info.channels = palette_.empty() ? kept_ : 3;
    note_orientation(layout.orientation, info);
    const GeoTiffPlace place = place_from_geotiff(handle.read_tags().geo, layout.height);
    if (!place.georeference.has_origin) return;
    if (place.rows_from_south) {
      throw Error(ErrorCode::kUnsupported, "its rows run from South to North; turn it first");
    }
    info.georeference = place.georeference;
  }

  std::optional<TiffBlocks> blocks_;
  std::int64_t width_ = 0;
  int stored_ = 0;  ///< samples of a pixel
  int kept_ = 0;
  bool inverted_ = false;  ///< 0 is white
  SampleType type_ = SampleType::kUint8;
  std::vector<std::array<std::uint8_t, 3>> palette_;
  std::vector<std::byte> raw_;
};

}  // namespace

std::unique_ptr<PhotoRows> open_tiff_rows(PhotoInfo& info) {
  return std::make_unique<TiffRows>(info);
}

}  // namespace isohf
