#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "formats/png/png_decoder.h"
#include "isohf/picture.h"

namespace isohf {

/// A picture's decoder behind the photo's cache, for one thread at a time. Errors carry no path.
class PhotoRows {
 public:
  PhotoRows() = default;
  PhotoRows(const PhotoRows&) = delete;
  PhotoRows& operator=(const PhotoRows&) = delete;
  virtual ~PhotoRows() = default;

  /// Rows [row, row + rows) as 8-bit sRGB. Where rows are decoded in order, going back begins again at the first.
  virtual void read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) = 0;
};

/// Of what is decoded row after row.
class DecodedRows final : public PhotoRows {
 public:
  /// Fills `info` as the functions below do, but for the format. `format`  for messages.
  DecodedRows(PhotoInfo& info, const char* format, std::unique_ptr<PictureDecoder> decoder);

  void read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) override;

 private:
  PictureRows rows_;
  int channels_;
};

/// Each fills `info` but for path, and block_height and random_access where rows are decoded one by one in order.
[[nodiscard]] std::unique_ptr<PhotoRows> open_png_rows(PhotoInfo& info);
[[nodiscard]] std::unique_ptr<PhotoRows> open_webp_rows(PhotoInfo& info);
[[nodiscard]] std::unique_ptr<PhotoRows> open_jpeg_rows(PhotoInfo& info);
[[nodiscard]] std::unique_ptr<PhotoRows> open_tiff_rows(PhotoInfo& info);
[[nodiscard]] std::unique_ptr<PhotoRows> open_oiio_rows(PhotoInfo& info);

/// The channels delivered of a picture that has `stored`, of which number `alpha` is opacity (-1: none is): as many, or
/// 3 of 4 with a warning. Throws Error{kUnsupported}.
[[nodiscard]] int photo_channels(int stored, int alpha, PhotoInfo& info);
/// Makes a band of rows whole rows of blocks of `block_rows`, one at least.
void read_whole_blocks(std::int64_t block_rows, PhotoInfo& info);
/// Warns if a picture's orientation tag (TIFF 6.0) asks for turning it.
void note_orientation(int orientation, PhotoInfo& info);
/// Samples of uint8, uint16, float16 or float32 as 8 bits, rounded; `is_light`: floats are light, but for a fourth
/// channel. Keeps the first `kept` channels of pixels of `stored`.
void photo_samples(SampleType type, std::span<const std::byte> raw, int stored, int kept, bool is_light,
                   std::span<std::uint8_t> samples);

}  // namespace isohf
