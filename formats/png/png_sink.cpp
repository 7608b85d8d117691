#include <fmt/format.h>
#include <png.h>

#include <array>
#include <cmath>
#include <csetjmp>
#include <cstdio>
#include <exception>
#include <new>
#include <utility>

#include "formats/write/encoders.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// The void value; negative: none.
int transparent_gray_of(const RasterSpec& spec) {
  if (!spec.void_value || spec.channels != 1) return -1;
  const double value = *spec.void_value;
  const double highest = spec.sample_type == SampleType::kUint8 ? 255.0 : 65535.0;
  if (!(value >= 0.0 && value <= highest) || value != std::floor(value)) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("the void value {} is none of 0...{}", value, highest));
  }
  return static_cast<int>(value);
}

class PngEncoder final : public RasterEncoder {
 public:
  PngEncoder(OutputFile& out, const RasterSpec& spec) : out_(out), row_bytes_(row_bytes(spec)) {
    const int transparent_gray = transparent_gray_of(spec);
    png_ = png_create_write_struct(PNG_LIBPNG_VER_STRING, this, on_error, on_warning);
    info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
    try {
      if (info_ == nullptr) throw std::bad_alloc();
      run([&] { start(spec, transparent_gray); });
    } catch (...) {
      png_destroy_write_struct(&png_, &info_);
      throw;
    }
  }
  ~PngEncoder() override { png_destroy_write_struct(&png_, &info_); }

  void write(std::span<const std::byte> rows, std::int64_t count) override {
    const auto* const first = reinterpret_cast<png_const_bytep>(rows.data());
    run([&] {
      for (std::size_t at = 0; at < static_cast<std::size_t>(count); ++at) png_write_row(png_, first + at * row_bytes_);
    });
  }

  void close() override {
    run([&] { png_write_end(png_, nullptr); });
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

  void start(const RasterSpec& spec, int transparent_gray) {
    const int bit_depth = static_cast<int>(8 * size_bytes(spec.sample_type));
    const int color_type = spec.channels == 1   ? PNG_COLOR_TYPE_GRAY
                           : spec.channels == 3 ? PNG_COLOR_TYPE_RGB
                                                : PNG_COLOR_TYPE_RGB_ALPHA;
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_write_fn(png_, this, on_write, on_flush);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(spec.width), static_cast<png_uint_32>(spec.height), bit_depth,
                 color_type, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (transparent_gray >= 0) {
      png_color_16 gray{};
      gray.gray = static_cast<png_uint_16>(transparent_gray);
      png_set_tRNS(png_, info_, nullptr, 0, &gray);
    }
    png_write_info(png_, info_);
    if (bit_depth == 16) png_set_swap(png_);  // PNG has the highest byte first
  }

  /// Runs calls of libpng, which leaves a failed one by longjmp: they hold nothing but trivial objects.
  template <typename Calls>
  void run(Calls calls) {
    if (setjmp(png_jmpbuf(png_)) == 0) return calls();  // NOLINT(cert-err52-cpp): libpng's way to return errors
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

}  // namespace

std::unique_ptr<RasterEncoder> encode_png(OutputFile& out, const RasterSpec& spec) {
  if (spec.sample_type != SampleType::kUint8 && spec.sample_type != SampleType::kUint16) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("PNG stores uint8 and uint16, not {}", to_string(spec.sample_type)));
  }
  return std::make_unique<PngEncoder>(out, spec);
}

}  // namespace isohf
