#include <memory>
#include <utility>

#include "formats/photo/photo.h"

namespace isohf {

DecodedRows::DecodedRows(PhotoInfo& info, const char* format, std::unique_ptr<PictureDecoder> decoder)
    : rows_(info.path, format, std::move(decoder), PictureDecoder::For::kPicture),
      channels_(static_cast<int>(rows_.header().channels.size())) {
  info.width = rows_.header().width;
  info.height = rows_.header().height;
  info.channels = photo_channels(channels_, channels_ - 1, info);
}

void DecodedRows::read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) {
  const SampleType type = rows_.header().bit_depth == 16 ? SampleType::kUint16 : SampleType::kUint8;
  const std::size_t out_bytes = samples.size() / static_cast<std::size_t>(rows);
  for (; !samples.empty(); samples = samples.subspan(out_bytes), ++row) {
    photo_samples(type, rows_.row(row), channels_, channels_, false, samples.first(out_bytes));
  }
}

std::unique_ptr<PhotoRows> open_png_rows(PhotoInfo& info) {
  info.format = "png";
  return std::make_unique<DecodedRows>(info, "PNG", std::make_unique<PngDecoder>());
}

std::unique_ptr<PhotoRows> open_webp_rows(PhotoInfo& info) {
  info.format = "webp";
  return std::make_unique<DecodedRows>(info, "WebP", std::make_unique<WebpDecoder>());
}

}  // namespace isohf
