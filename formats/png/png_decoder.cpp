#include "formats/png/png_decoder.h"

#include <fmt/format.h>
#include <png.h>

#include <cerrno>
#include <csetjmp>
#include <filesystem>
#include <utility>

#include "formats/readers.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Deflate's highest compression: 258 bytes from two bits and a little.
constexpr std::uint64_t kMaxCompressionRatio = 1032;
constexpr int kAdam7Passes = 7;

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

png_bytep bytes_of(std::span<std::byte> samples) {
  return reinterpret_cast<png_bytep>(samples.data());
}

}  // namespace

bool PictureDecoder::fail(const char* text) {
  std::snprintf(message_.data(), message_.size(), "%s", text);
  return false;
}

bool PictureDecoder::open(std::FILE* file, PngHeader& header) {
  file_.reset(file);
  header = {};
  return file_ != nullptr ? read_header(header) : fail(std::strerror(errno));
}

bool PictureDecoder::open(const std::string& path, PngHeader& header) {
  return open(std::fopen(path.c_str(), "rb"), header);
}

bool PictureDecoder::open(std::span<const std::byte> stored, PngHeader& header) {
  return open(::fmemopen(const_cast<std::byte*>(stored.data()), stored.size(), "rb"), header);  // which writes nothing
}

/// Runs calls of libpng, which leaves a failed one by longjmp: they hold nothing but trivial objects.
template <typename Calls>
bool PngDecoder::run(Calls calls) {
  if (setjmp(png_jmpbuf(png_)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng's way to return errors
  calls();
  return true;
}

PngDecoder::~PngDecoder() {
  png_destroy_read_struct(&png_, &info_, nullptr);
}

bool PngDecoder::read_header(PngHeader& header) {
  png_destroy_read_struct(&png_, &info_, nullptr);
  const auto on_error = [](png_structp png, png_const_charp text) {
    static_cast<PngDecoder*>(png_get_error_ptr(png))->fail(text);
    png_longjmp(png, 1);
  };
  png_ = png_create_read_struct(PNG_LIBPNG_VER_STRING, this, on_error, [](png_structp, png_const_charp) {});
  info_ = png_ != nullptr ? png_create_info_struct(png_) : nullptr;
  if (info_ == nullptr) return fail("out of memory");
  const bool is_read = run([&] {
    png_set_user_limits(png_, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_init_io(png_, file());
    // A damaged chunk is left out with a warning else; it may hold the sample that means void.
    png_set_crc_action(png_, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
    png_read_info(png_, info_);
  });
  if (!is_read) return false;
  const int color_type = png_get_color_type(png_, info_);
  header.width = png_get_image_width(png_, info_);
  header.height = png_get_image_height(png_, info_);
  header.bit_depth = png_get_bit_depth(png_, info_);
  header.has_palette = color_type == PNG_COLOR_TYPE_PALETTE;
  header.channels = channels_of(color_type);
  header.interlaced = png_get_interlace_type(png_, info_) != PNG_INTERLACE_NONE;
  header.row_bytes = png_get_rowbytes(png_, info_);
  png_color_16p colour = nullptr;
  if (png_get_tRNS(png_, info_, nullptr, nullptr, &colour) == 0 || colour == nullptr) return true;
  if (color_type == PNG_COLOR_TYPE_GRAY) header.transparent_number = colour->gray;
  const bool is_grey = colour->red == colour->green && colour->red == colour->blue;
  if (color_type == PNG_COLOR_TYPE_RGB && is_grey) header.transparent_number = colour->red;
  return true;
}

bool PngDecoder::start(PngHeader& header, For use) {
  const bool is_started = run([&] {
    if (use == For::kPicture) {
      png_set_expand(png_);
    } else if (header.bit_depth < 8) {
      png_set_packing(png_);  // a byte each, values as stored
    }
    if (header.bit_depth == 16) png_set_swap(png_);  // PNG has the highest byte first
    if (header.interlaced) (void)png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
  });
  if (!is_started) return false;
  header.row_bytes = png_get_rowbytes(png_, info_);
  if (use == For::kPicture) header.bit_depth = png_get_bit_depth(png_, info_);
  header.channels = channels_of(png_get_color_type(png_, info_));
  return true;
}

bool PngDecoder::read_row(std::span<std::byte> row) {
  return run([&] { png_read_row(png_, bytes_of(row), nullptr); });
}

bool PngDecoder::read_picture(std::span<std::byte> picture, const PngHeader& header) {
  return run([&] {
    for (int pass = 0; pass < (header.interlaced ? kAdam7Passes : 1); ++pass) {
      for (std::size_t at = 0; at < header.height * header.row_bytes; at += header.row_bytes) {
        png_read_row(png_, bytes_of(picture.subspan(at, header.row_bytes)), nullptr);
      }
    }
  });
}

bool PngDecoder::finish() {
  return run([&] { png_read_end(png_, nullptr); });
}

PictureRows::PictureRows(std::string path, std::string format, std::unique_ptr<PictureDecoder> decoder,
                         PictureDecoder::For use)
    : path_(std::move(path)), format_(std::move(format)), decoder_(std::move(decoder)), use_(use) {
  restart();
}

void PictureRows::restart() {
  next_row_ = 0;
  bytes_.reset();
  if (!decoder_->open(path_, header_)) {
    throw Error(decoder_->has_file() ? ErrorCode::kCorrupt : ErrorCode::kIo,
                fmt::format("{} header: {}", format_, decoder_->message()));
  }
  const std::uint64_t picture_bytes = (header_.row_bytes + 1) * std::uint64_t{header_.height};
  std::error_code error;
  const std::uint64_t file_size = std::filesystem::file_size(path_, error);
  if (!error && picture_bytes / kMaxCompressionRatio > file_size && format_ == "PNG") {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("PNG header declares {} x {} pixels, for which a file of {} bytes has no room",
                            header_.width, header_.height, file_size));
  }
  if (header_.interlaced && picture_bytes > kMaxInterlacedBytes) {
    throw Error(ErrorCode::kUnsupported,
                fmt::format("interlaced {} of {} x {} pixels would take more than {} MiB; store it without interlacing",
                            format_, header_.width, header_.height, kMaxInterlacedBytes >> 20U));
  }
  if (!decoder_->start(header_, use_)) fail(format_ + " header");
}

std::span<const std::byte> PictureRows::row(std::int64_t row) {
  const std::size_t row_bytes = header_.row_bytes;
  if (header_.interlaced) {
    const std::size_t bytes = row_bytes * header_.height;
    if (bytes_ == nullptr) {
      if (next_row_ > 0) restart();  // after an error
      // Memory that a damaged picture does not come to is never touched.
      bytes_ = std::make_unique_for_overwrite<std::byte[]>(bytes);
      if (!decoder_->read_picture({bytes_.get(), bytes}, header_) || !decoder_->finish()) {
        fail(format_ == "PNG" ? "interlaced PNG" : format_);
      }
    }
    return {bytes_.get() + static_cast<std::size_t>(row) * row_bytes, row_bytes};
  }
  if (row < next_row_) restart();
  if (bytes_ == nullptr) bytes_ = std::make_unique_for_overwrite<std::byte[]>(row_bytes);
  const std::span bytes(bytes_.get(), row_bytes);
  for (; next_row_ <= row; ++next_row_) {
    const bool is_last = next_row_ + 1 == static_cast<std::int64_t>(header_.height);
    if (!decoder_->read_row(bytes) || (is_last && !decoder_->finish()))
      fail(fmt::format("{} row {}", format_, next_row_));
  }
  return bytes;
}

std::uint64_t PictureRows::buffer_bytes() const {
  return header_.row_bytes * std::uint64_t{header_.interlaced ? header_.height : 2};
}

/// The decoder cannot go on after an error: the next request begins again.
void PictureRows::fail(const std::string& where) {
  next_row_ = INT64_MAX;
  bytes_.reset();
  throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}", where, decoder_->message()));
}

Error naming(const std::string& path, const Error& error) {
  return std::string_view(error.what()).starts_with(path + ": ") ? error.at(path) : error.within(path);
}

std::string png_library() {
  return std::string("libpng ") + png_get_libpng_ver(nullptr);
}

}  // namespace isohf
