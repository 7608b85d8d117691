#include <fmt/format.h>
#include <png.h>

#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <exception>
#include <utility>

#include "formats/write/encoders.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// What goes into the header.
struct PngLayout {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  int bit_depth = 0;
  int color_type = 0;
  int transparent_gray = -1;  ///< negative: none
};

/// libpng leaves a failed call by longjmp: each member that calls it holds nothing but trivial objects, returns false
/// on failure, and leaves the reason in message().
class PngEncoder final : public RasterEncoder {
 public:
  PngEncoder(OutputFile& out, const PngLayout& layout, std::size_t row_bytes) : out_(out), row_bytes_(row_bytes) {
    if (!start(layout)) {
      release();
      fail();
    }
  }
  ~PngEncoder() override { release(); }

  void write(std::span<const std::byte> rows, std::int64_t count) override {
    const auto* row = reinterpret_cast<png_const_bytep>(rows.data());
    for (std::int64_t at = 0; at < count; ++at, row += row_bytes_) {
      if (!write_row(row)) fail();
    }
  }

  void close() override {
    if (!write_end()) fail();
  }

 private:
  static void on_error(png_structp png, png_const_charp text) {
    auto& message = static_cast<PngEncoder*>(png_get_error_ptr(png))->message_;
    std::snprintf(message.data(), message.size(), "%s", text);
    png_longjmp(png, 1);
  }
  static void on_warning(png_structp, png_const_charp) {}
  static void on_write(png_structp png, png_bytep data, std::size_t count) {
    if (!static_cast<PngEncoder*>(png_get_io_ptr(png))->append({reinterpret_cast<std::byte*>(data), count})) {
      png_error(png, "output failed");
    }
  }
  static void on_flush(png_structp) {}

  [[nodiscard]] bool append(std::span<const std::byte> bytes) noexcept {
    try {
      out_.append(bytes);
      return true;
    } catch (...) {
      failure_ = std::current_exception();  // not through libpng's frames
      return false;
    }
  }

  [[nodiscard]] bool start(const PngLayout& layout) {
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
    info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
    if (info_ == nullptr) {
      std::snprintf(message_.data(), message_.size(), "out of memory");
      return false;
    }
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng's way to return errors
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_write_fn(png_, this, on_write, on_flush);
    png_set_IHDR(png_, info_, layout.width, layout.height, layout.bit_depth, layout.color_type, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (layout.transparent_gray >= 0) {
      png_color_16 gray{};
      gray.gray = static_cast<png_uint_16>(layout.transparent_gray);
      png_set_tRNS(png_, info_, nullptr, 0, &gray);
    }
    png_write_info(png_, info_);
    if (layout.bit_depth == 16) png_set_swap(png_);  // PNG has the highest byte first
    return true;
  }

  [[nodiscard]] bool write_row(png_const_bytep row) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
    png_write_row(png_, row);
    return true;
  }

  [[nodiscard]] bool write_end() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp)
    png_write_end(png_, nullptr);
    return true;
  }

  void release() {
    if (png_ != nullptr) png_destroy_write_struct(&png_, &info_);
  }

  [[noreturn]] void fail() {
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    throw Error(ErrorCode::kIo, fmt::format("PNG cannot be written: {}", message_.data()));
  }

  OutputFile& out_;
  std::size_t row_bytes_;
  std::exception_ptr failure_;
  png_structp png_ = nullptr;
  png_infop info_ = nullptr;
  std::array<char, 256> message_{};
};

PngLayout layout_of(const RasterSpec& spec) {
  PngLayout layout;
  layout.width = static_cast<std::uint32_t>(spec.width);
  layout.height = static_cast<std::uint32_t>(spec.height);
  switch (spec.sample_type) {
    case SampleType::kUint8:
      layout.bit_depth = 8;
      break;
    case SampleType::kUint16:
      layout.bit_depth = 16;
      break;
    default:
      throw Error(ErrorCode::kInvalidArgument,
                  fmt::format("PNG stores uint8 and uint16, not {}", to_string(spec.sample_type)));
  }
  layout.color_type = spec.channels == 1   ? PNG_COLOR_TYPE_GRAY
                      : spec.channels == 3 ? PNG_COLOR_TYPE_RGB
                                           : PNG_COLOR_TYPE_RGB_ALPHA;
  if (spec.void_value && spec.channels == 1) {
    const double value = *spec.void_value;
    const double highest = layout.bit_depth == 8 ? 255.0 : 65535.0;
    if (!(value >= 0.0 && value <= highest) || value != std::floor(value)) {
      throw Error(ErrorCode::kInvalidArgument, fmt::format("the void value {} is none of 0...{}", value, highest));
    }
    layout.transparent_gray = static_cast<int>(value);
  }
  return layout;
}

}  // namespace

std::unique_ptr<RasterEncoder> encode_png(OutputFile& out, const RasterSpec& spec) {
  return std::make_unique<PngEncoder>(out, layout_of(spec), row_bytes(spec));
}

}  // namespace isohf
