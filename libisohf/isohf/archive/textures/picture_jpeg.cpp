#include <fmt/format.h>

#include <cstdlib>
#include <memory>

#include "isohf/archive/textures/picture_codec.h"
#include "isohf/base/assert.h"
#include "isohf/base/jpeg_errors.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// The functions that call libjpeg hold nothing that a jump could leak.
bool compress(jpeg_compress_struct& jpeg, JpegErrors& errors, const Picture& picture, int quality,
              unsigned char** bytes, unsigned long* size) {  // NOLINT(google-runtime-int): libjpeg's type
  if (setjmp(errors.jump) != 0) return false;                // NOLINT(cert-err52-cpp)
  jpeg_create_compress(&jpeg);
  jpeg_mem_dest(&jpeg, bytes, size);
  jpeg.image_width = static_cast<JDIMENSION>(picture.width);
  jpeg.image_height = static_cast<JDIMENSION>(picture.height);
  jpeg.input_components = picture.channels;
  jpeg.in_color_space = picture.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&jpeg);
  jpeg_set_quality(&jpeg, quality, TRUE);
  jpeg.dct_method = JDCT_ISLOW;
  jpeg.optimize_coding = TRUE;
  for (int c = 0; c < jpeg.num_components; ++c) jpeg.comp_info[c].h_samp_factor = jpeg.comp_info[c].v_samp_factor = 1;
  jpeg_start_compress(&jpeg, TRUE);
  while (jpeg.next_scanline < jpeg.image_height) {
    // libjpeg does not write to the row, but says nowhere that it is const.
    auto* row = const_cast<JSAMPROW>(picture.row(static_cast<int>(jpeg.next_scanline)));
    (void)jpeg_write_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_compress(&jpeg);
  return true;
}

bool start_reading(jpeg_decompress_struct& jpeg, JpegErrors& errors, std::span<const std::byte> bytes) {
  if (setjmp(errors.jump) != 0) return false;  // NOLINT(cert-err52-cpp)
  jpeg_create_decompress(&jpeg);
  jpeg_mem_src(&jpeg, reinterpret_cast<const unsigned char*>(bytes.data()),
               static_cast<unsigned long>(bytes.size()));  // NOLINT(google-runtime-int)
  jpeg_read_header(&jpeg, TRUE);
  return true;
}

bool read_rows(jpeg_decompress_struct& jpeg, JpegErrors& errors, Picture& picture) {
  if (setjmp(errors.jump) != 0) return false;  // NOLINT(cert-err52-cpp)
  jpeg.dct_method = JDCT_ISLOW;
  jpeg.out_color_space = picture.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_start_decompress(&jpeg);
  while (jpeg.output_scanline < jpeg.output_height) {
    auto* row = picture.row(static_cast<int>(jpeg.output_scanline));
    (void)jpeg_read_scanlines(&jpeg, &row, 1);
  }
  jpeg_finish_decompress(&jpeg);
  return true;
}

}  // namespace

std::vector<std::byte> encode_jpeg(const Picture& picture, int quality) {
  ISOHF_ASSERT((picture.channels == 1 || picture.channels == 3) && quality >= 1 && quality <= 100);
  JpegErrors errors;
  jpeg_compress_struct jpeg{};
  jpeg.err = &errors.base;
  unsigned char* bytes = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int)
  const bool done = compress(jpeg, errors, picture, quality, &bytes, &size);
  jpeg_destroy_compress(&jpeg);
  const std::unique_ptr<unsigned char, decltype(&std::free)> owner(bytes, &std::free);
  if (!done) throw Error(ErrorCode::kOutOfMemory, fmt::format("libjpeg: {}", errors.text.data()));
  const auto* const first = reinterpret_cast<const std::byte*>(bytes);
  return {first, first + size};
}

Picture decode_jpeg(std::span<const std::byte> bytes, int most) {
  JpegErrors errors;
  jpeg_decompress_struct jpeg{};
  jpeg.err = &errors.base;
  const std::unique_ptr<jpeg_decompress_struct, decltype(&jpeg_destroy_decompress)> owner(&jpeg,
                                                                                          &jpeg_destroy_decompress);
  const auto refuse = [&] { throw Error(ErrorCode::kCorrupt, fmt::format("JPEG: {}", errors.text.data())); };
  if (!start_reading(jpeg, errors, bytes)) refuse();
  const auto limit = static_cast<JDIMENSION>(most);
  if (jpeg.image_width > limit || jpeg.image_height > limit) {
    throw Error(ErrorCode::kCorrupt, fmt::format("JPEG: {} x {} pixels, at most {} x {} are possible", jpeg.image_width,
                                                 jpeg.image_height, most, most));
  }
  if (jpeg.num_components != 1 && jpeg.num_components != 3) {
    throw Error(ErrorCode::kUnsupported, fmt::format("JPEG: {} components; 1 and 3 are read", jpeg.num_components));
  }
  Picture picture(static_cast<int>(jpeg.image_width), static_cast<int>(jpeg.image_height), jpeg.num_components);
  if (!read_rows(jpeg, errors, picture)) refuse();
  return picture;
}

}  // namespace isohf
