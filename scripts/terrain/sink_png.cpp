#include <png.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "isohf/error.h"
#include "sink.h"

namespace isohf::terrain {
namespace {

[[noreturn]] void on_error(png_structp png, png_const_charp message) {
  throw Error(ErrorCode::kIo, *static_cast<const std::string*>(png_get_error_ptr(png)) + ": " + message);
}

void on_warning(png_structp /*png*/, png_const_charp /*message*/) {}

/// 16-bit grey.
class PngSink final : public Sink {
 public:
  PngSink(const std::string& path, const Raster& raster)
      : path_(path), row_bytes_(static_cast<std::size_t>(raster.columns) * 2), file_(std::fopen(path.c_str(), "wb")) {
    if (file_ == nullptr) throw Error(ErrorCode::kIo, path + ": cannot create: " + std::strerror(errno));
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, &path_, on_error, on_warning);
    info_ = png_create_info_struct(png_);
    png_init_io(png_, file_);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(raster.columns), static_cast<png_uint_32>(raster.rows), 16,
                 PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png_, info_);
    png_set_swap(png_);
  }
  ~PngSink() override {
    png_destroy_write_struct(&png_, &info_);
    if (file_ != nullptr) std::fclose(file_);
  }

  void write_band(std::span<std::byte> samples) override {
    for (std::size_t at = 0; at < samples.size(); at += row_bytes_) {
      png_write_row(png_, reinterpret_cast<png_const_bytep>(samples.data() + at));
    }
  }

  void finish() override {
    png_write_end(png_, nullptr);
    if (std::fclose(std::exchange(file_, nullptr)) != 0) {
      throw Error(ErrorCode::kIo, path_ + ": cannot write: " + std::strerror(errno));
    }
  }

 private:
  std::string path_;
  std::size_t row_bytes_;
  std::FILE* file_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
};

}  // namespace

std::unique_ptr<Sink> make_png_sink(const std::string& path, const Raster& raster) {
  return std::make_unique<PngSink>(path, raster);
}

}  // namespace isohf::terrain
