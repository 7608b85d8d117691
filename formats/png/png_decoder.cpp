#include "formats/png/png_decoder.h"

#include <png.h>

#include <cerrno>
#include <csetjmp>

#include "formats/readers.h"
#include "isohf/base/bytes.h"

// libpng leaves a failed call by longjmp: a function that calls setjmp holds nothing but trivial objects.

namespace isohf {
namespace {

std::vector<const char*> channels_of(int color_type) {
  switch (color_type) {
    case PNG_COLOR_TYPE_GRAY:
      return {"Y"};
    case PNG_COLOR_TYPE_GRAY_ALPHA:
      return {"Y", "A"};
    case PNG_COLOR_TYPE_RGB:
    case PNG_COLOR_TYPE_PALETTE:
      return {"R", "G", "B"};
    default:
      return {"R", "G", "B", "A"};
  }
}

}  // namespace

struct PngDecoder::Callbacks {
  static void on_error(png_structp png, png_const_charp text) {
    static_cast<PngDecoder*>(png_get_error_ptr(png))->fail(text);
    png_longjmp(png, 1);
  }
  static void on_warning(png_structp, png_const_charp) {}
};

bool PictureDecoder::fail(const char* text) {
  std::snprintf(message_.data(), message_.size(), "%s", text);
  return false;
}

void PngDecoder::close() {
  if (png_ != nullptr) png_destroy_read_struct(&png_, &info_, nullptr);
  if (file_ != nullptr) std::fclose(file_);
  png_ = nullptr;
  info_ = nullptr;
  file_ = nullptr;
}

bool PngDecoder::open(const std::string& path, PngHeader& header) {
  close();
  file_ = std::fopen(path.c_str(), "rb");
  return begin(header);
}

bool PngDecoder::open(std::span<const std::byte> stored, PngHeader& header) {
  close();
  file_ = ::fmemopen(const_cast<std::byte*>(stored.data()), stored.size(), "rb");  // which writes nothing
  return begin(header);
}

bool PngDecoder::begin(PngHeader& header) {
  if (file_ == nullptr) return fail(std::strerror(errno));
  png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, Callbacks::on_error, Callbacks::on_warning);
  info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
  if (info_ == nullptr) return fail("out of memory");
  int color_type = 0;
  if (!read_header(header, color_type)) return false;
  header.has_palette = color_type == PNG_COLOR_TYPE_PALETTE;
  header.channels = channels_of(color_type);
  return true;
}

bool PngDecoder::read_header(PngHeader& header, int& color_type) {
  if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng's way to return errors
  png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
  png_init_io(png_, file_);
  // A damaged chunk is left out with a warning else; it may hold the sample that means void.
  png_set_crc_action(png_, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  png_read_info(png_, info_);
  header.width = png_get_image_width(png_, info_);
  header.height = png_get_image_height(png_, info_);
  header.bit_depth = png_get_bit_depth(png_, info_);
  color_type = png_get_color_type(png_, info_);
  header.interlaced = png_get_interlace_type(png_, info_) != PNG_INTERLACE_NONE;
  png_color_16p transparent = nullptr;
  if (color_type == PNG_COLOR_TYPE_GRAY && png_get_tRNS(png_, info_, nullptr, nullptr, &transparent) != 0 &&
      transparent != nullptr) {
    header.has_transparent_gray = true;
    header.transparent_gray = transparent->gray;
  }
  header.row_bytes = png_get_rowbytes(png_, info_);
  return true;
}

bool PngDecoder::start(PngHeader& header, For use) {
  if (!update(header, use)) return false;
  header.channels = channels_of(png_get_color_type(png_, info_));
  return true;
}

bool PngDecoder::update(PngHeader& header, For use) {
  if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
  if (use == For::kPicture) {
    png_set_expand(png_);
  } else if (header.bit_depth < 8) {
    png_set_packing(png_);  // a byte each, values as stored
  }
  if (header.bit_depth == 16) png_set_swap(png_);  // PNG has the highest byte first
  if (header.interlaced) (void)png_set_interlace_handling(png_);
  png_read_update_info(png_, info_);
  header.row_bytes = png_get_rowbytes(png_, info_);
  if (use == For::kPicture) header.bit_depth = png_get_bit_depth(png_, info_);
  return true;
}

bool PngDecoder::read_row(std::span<std::byte> row) {
  if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
  png_read_row(png_, reinterpret_cast<png_bytep>(row.data()), nullptr);
  return true;
}

bool PngDecoder::read_picture(std::span<std::byte> picture, const PngHeader& header) {
  std::vector<png_bytep> rows(header.height);
  for (std::size_t row = 0; row < rows.size(); ++row) {
    rows[row] = reinterpret_cast<png_bytep>(picture.data() + row * header.row_bytes);
  }
  return read_rows(rows.data());
}

bool PngDecoder::read_rows(unsigned char** rows) {
  if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
  png_read_image(png_, rows);
  return true;
}

bool PngDecoder::finish() {
  if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
  png_read_end(png_, nullptr);
  return true;
}

std::string png_library() {
  return std::string("libpng ") + png_get_libpng_ver(nullptr);
}

}  // namespace isohf
