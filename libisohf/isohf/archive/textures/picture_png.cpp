#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <new>

#include "isohf/archive/textures/picture_codec.h"
#include "isohf/base/assert.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr int kCompressionLevel = 6;

/// What libpng's callbacks say before they jump.
struct Failure {
  std::array<char, 160> text{};

  static void note(png_structp png, png_const_charp text) {
    auto* const failure = static_cast<Failure*>(png_get_error_ptr(png));
    std::snprintf(failure->text.data(), failure->text.size(), "%s", text);
    png_longjmp(png, 1);
  }
  static void ignore(png_structp, png_const_charp) {}
};

int colour_type(int channels) {
  if (channels == 1) return PNG_COLOR_TYPE_GRAY;
  return channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA;
}

/// A growing buffer; running out of memory must not throw through libpng.
struct Sink {
  std::vector<std::byte> bytes;
  bool full = false;

  static void write(png_structp png, png_bytep data, std::size_t size) {
    auto* const sink = static_cast<Sink*>(png_get_io_ptr(png));
    try {
      const auto* const from = reinterpret_cast<const std::byte*>(data);
      sink->bytes.insert(sink->bytes.end(), from, from + size);
    } catch (const std::bad_alloc&) {
      sink->full = true;
    }
    if (sink->full) png_error(png, "out of memory");
  }
  static void flush(png_structp) {}
};

struct Input {
  std::span<const std::byte> left;

  static void read(png_structp png, png_bytep data, std::size_t size) {
    auto* const input = static_cast<Input*>(png_get_io_ptr(png));
    if (size > input->left.size()) png_error(png, "ends early");
    std::memcpy(data, input->left.data(), size);
    input->left = input->left.subspan(size);
  }
};

/// Holds nothing that a jump could leak.
bool write_all(png_structp png, png_infop info, const Picture& picture, Sink& sink) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;  // NOLINT(cert-err52-cpp): libpng's way to return errors
  png_set_write_fn(png, &sink, Sink::write, Sink::flush);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height), 8,
               colour_type(picture.channels), PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_compression_level(png, kCompressionLevel);
  png_write_info(png, info);
  for (int row = 0; row < picture.height; ++row) png_write_row(png, picture.row(row));
  png_write_end(png, nullptr);
  return true;
}

struct Header {
  png_uint_32 width = 0;
  png_uint_32 height = 0;
  int depth = 0;
  int type = 0;
  int interlace = 0;
};

bool read_header(png_structp png, png_infop info, Input& input, Header& header) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;  // NOLINT(cert-err52-cpp)
  png_set_read_fn(png, &input, Input::read);
  png_set_crc_action(png, PNG_CRC_ERROR_QUIT, PNG_CRC_ERROR_QUIT);
  png_read_info(png, info);
  png_get_IHDR(png, info, &header.width, &header.height, &header.depth, &header.type, &header.interlace, nullptr,
               nullptr);
  return true;
}

bool read_rows(png_structp png, Picture& picture) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;  // NOLINT(cert-err52-cpp)
  for (int row = 0; row < picture.height; ++row) png_read_row(png, picture.row(row), nullptr);
  png_read_end(png, nullptr);
  return true;
}

/// A reading or writing handle that frees itself.
struct Handle {
  Failure failure;
  png_structp png = nullptr;
  png_infop info = nullptr;
  bool writes;

  explicit Handle(bool for_writing) : writes(for_writing) {
    png = writes ? png_create_write_struct(PNG_LIBPNG_VER_STRING, &failure, Failure::note, Failure::ignore)
                 : png_create_read_struct(PNG_LIBPNG_VER_STRING, &failure, Failure::note, Failure::ignore);
    info = png != nullptr ? png_create_info_struct(png) : nullptr;
    if (info == nullptr) {
      close();
      throw Error(ErrorCode::kOutOfMemory, "libpng: out of memory");
    }
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { close(); }

  void close() {
    if (writes) png_destroy_write_struct(&png, &info);
    if (!writes) png_destroy_read_struct(&png, &info, nullptr);
  }
};

}  // namespace

std::vector<std::byte> encode_png(const Picture& picture) {
  ISOHF_ASSERT(picture.channels == 1 || picture.channels == 3 || picture.channels == 4);
  Handle handle(true);
  Sink sink;
  if (!write_all(handle.png, handle.info, picture, sink)) {
    throw Error(ErrorCode::kOutOfMemory, fmt::format("libpng: {}", handle.failure.text.data()));
  }
  return std::move(sink.bytes);
}

Picture decode_png(std::span<const std::byte> bytes, int most) {
  Handle handle(false);
  const auto refuse = [&] { throw Error(ErrorCode::kCorrupt, fmt::format("PNG: {}", handle.failure.text.data())); };
  Input input{bytes};
  Header header;
  if (!read_header(handle.png, handle.info, input, header)) refuse();
  const auto limit = static_cast<png_uint_32>(most);
  if (header.width > limit || header.height > limit) {
    throw Error(ErrorCode::kCorrupt, fmt::format("PNG: {} x {} pixels, at most {} x {} are possible", header.width,
                                                 header.height, most, most));
  }
  const int channels = png_get_channels(handle.png, handle.info);
  if (header.depth != 8 || header.interlace != PNG_INTERLACE_NONE || header.type == PNG_COLOR_TYPE_PALETTE ||
      channels == 2) {
    throw Error(ErrorCode::kUnsupported, fmt::format("PNG: {} channels of {} bits, colour type {}; 8-bit grey, RGB and "
                                                     "RGBA without interlacing are read",
                                                     channels, header.depth, header.type));
  }
  Picture picture(static_cast<int>(header.width), static_cast<int>(header.height), channels);
  if (!read_rows(handle.png, picture)) refuse();
  if (!input.left.empty()) throw Error(ErrorCode::kCorrupt, fmt::format("PNG: {} bytes too many", input.left.size()));
  return picture;
}

}  // namespace isohf
