#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <vector>

#include "formats/photo/photo.h"
#include "isohf/base/jpeg_errors.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr int kExif = JPEG_APP0 + 1;

/// The orientation (tag 0x0112) in the first directory of EXIF data, a TIFF file behind "Exif" and two zeros
/// (CIPA DC-008, 4.5.4 and 4.6.4); 1 where there is none.
int exif_orientation(std::span<const unsigned char> data) {
  constexpr std::size_t kPrefixBytes = 6;
  constexpr unsigned kOrientation = 0x0112;
  if (data.size() < kPrefixBytes + 8 || data[0] != 'E' || data[1] != 'x' || data[2] != 'i' || data[3] != 'f') return 1;
  const auto tiff = data.subspan(kPrefixBytes);
  const bool big = tiff[0] == 'M';
  const auto number = [&](std::size_t at, std::size_t bytes) {
    std::size_t value = 0;
    if (at > tiff.size() || bytes > tiff.size() - at) return value;
    for (std::size_t i = 0; i < bytes; ++i) value |= std::size_t{tiff[at + i]} << (8 * (big ? bytes - 1 - i : i));
    return value;
  };
  const std::size_t directory = number(4, 4);
  for (std::size_t i = 0; i < number(directory, 2); ++i) {
    const std::size_t entry = directory + 2 + 12 * i;
    if (number(entry, 2) == kOrientation) return static_cast<int>(number(entry + 8, 2));
  }
  return 1;
}

/// The functions that call libjpeg hold nothing that a jump could leak.
bool read_header(jpeg_decompress_struct& jpeg, JpegErrors& errors, std::FILE* file) {
  if (setjmp(errors.jump) != 0) return false;  // NOLINT(cert-err52-cpp): libjpeg's way to return errors
  jpeg_create_decompress(&jpeg);
  jpeg_stdio_src(&jpeg, file);
  jpeg_save_markers(&jpeg, kExif, 0xFFFF);
  jpeg_read_header(&jpeg, TRUE);
  return true;
}

bool start(jpeg_decompress_struct& jpeg, JpegErrors& errors) {
  if (setjmp(errors.jump) != 0) return false;  // NOLINT(cert-err52-cpp)
  jpeg.dct_method = JDCT_ISLOW;
  const bool has_ink = jpeg.num_components == 4;
  jpeg.out_color_space = jpeg.num_components == 1 ? JCS_GRAYSCALE : has_ink ? JCS_CMYK : JCS_RGB;
  return jpeg_start_decompress(&jpeg) != FALSE;
}

bool read_row(jpeg_decompress_struct& jpeg, JpegErrors& errors, unsigned char* row) {
  if (setjmp(errors.jump) != 0) return false;  // NOLINT(cert-err52-cpp)
  if (jpeg_read_scanlines(&jpeg, &row, 1) != 1) return false;
  if (jpeg.output_scanline == jpeg.output_height) jpeg_finish_decompress(&jpeg);
  return true;
}

class JpegRows final : public PhotoRows {
 public:
  explicit JpegRows(PhotoInfo& info) : path_(info.path) {
    restart();
    info.format = "jpeg";
    info.width = jpeg_->image_width;
    info.height = jpeg_->image_height;
    // CMYK becomes RGB.
    info.channels = jpeg_->num_components == 4 ? 3 : photo_channels(jpeg_->num_components, -1, info);
    for (const jpeg_marker_struct* marker = jpeg_->marker_list; marker != nullptr; marker = marker->next) {
      if (marker->marker != kExif) continue;
      const int orientation = exif_orientation({marker->data, marker->data_length});
      if (orientation >= 1 && orientation <= 8) note_orientation(orientation, info);
    }
    begin();
  }
  ~JpegRows() override { close(); }

  void read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) override {
    if (jpeg_ == nullptr || row < next_row_) {
      restart();
      begin();
    }
    const std::size_t out_bytes = samples.size() / static_cast<std::size_t>(rows);
    const bool has_ink = jpeg_->num_components == 4;
    for (; next_row_ < row + rows; ++next_row_) {
      if (!read_row(*jpeg_, errors_, row_.data())) fail(fmt::format("JPEG row {}", next_row_));
      if (next_row_ < row) continue;
      std::uint8_t* const out = samples.data() + static_cast<std::size_t>(next_row_ - row) * out_bytes;
      if (!has_ink) {
        std::copy(row_.begin(), row_.end(), out);
        continue;
      }
      // Adobe's programs, which write such files, store what is left of the light.
      for (std::size_t i = 0; i < out_bytes; ++i) {
        const unsigned ink = row_[i / 3 * 4 + i % 3];
        const unsigned black = row_[i / 3 * 4 + 3];
        out[i] = static_cast<std::uint8_t>((ink * black + 127) / 255);
      }
    }
  }

 private:
  void restart() {
    close();
    next_row_ = 0;
    file_.reset(std::fopen(path_.c_str(), "rb"));
    if (!file_) throw Error(ErrorCode::kIo, "cannot be opened");
    jpeg_ = std::make_unique<jpeg_decompress_struct>();
    jpeg_->err = &errors_.base;
    if (!read_header(*jpeg_, errors_, file_.get())) fail("JPEG header");
  }

  void begin() {
    if (!start(*jpeg_, errors_)) fail("JPEG header");
    row_.resize(std::size_t{jpeg_->output_width} * static_cast<std::size_t>(jpeg_->output_components));
  }

  void close() {
    if (jpeg_) jpeg_destroy_decompress(jpeg_.get());
    jpeg_.reset();
  }

  /// The decoder cannot go on after an error: the next row, whichever, begins again.
  [[noreturn]] void fail(const std::string& where) {
    close();
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}", where, errors_.text.data()));
  }

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };

  std::string path_;
  JpegErrors errors_;
  std::unique_ptr<std::FILE, Close> file_;
  std::unique_ptr<jpeg_decompress_struct> jpeg_;
  std::int64_t next_row_ = 0;
  std::vector<unsigned char> row_;
};

}  // namespace

std::unique_ptr<PhotoRows> open_jpeg_rows(PhotoInfo& info) {
  return std::make_unique<JpegRows>(info);
}

}  // namespace isohf
