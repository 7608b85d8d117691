#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "formats/photo/photo.h"
#include "isohf/base/jpeg_errors.h"

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

/// libjpeg's, of 8 bits: grey, or RGB, also of CMYK.
class JpegDecoder final : public PictureDecoder {
 public:
  ~JpegDecoder() override { jpeg_destroy_decompress(&jpeg_); }

  [[nodiscard]] int orientation() const {
    for (const jpeg_marker_struct* marker = jpeg_.marker_list; marker != nullptr; marker = marker->next) {
      if (marker->marker == kExif) return exif_orientation({marker->data, marker->data_length});
    }
    return 1;
  }

  [[nodiscard]] bool start(PngHeader& /*header*/, For /*use*/) override {
    const bool is_started = run([&] {
      jpeg_.dct_method = JDCT_ISLOW;
      jpeg_.out_color_space = has_ink() ? JCS_CMYK : jpeg_.num_components == 1 ? JCS_GRAYSCALE : JCS_RGB;
      jpeg_start_decompress(&jpeg_);
    });
    if (is_started && has_ink()) inks_.resize(std::size_t{4} * jpeg_.output_width);
    return is_started;
  }

  [[nodiscard]] bool read_row(std::span<std::byte> row) override {
    auto* const samples = reinterpret_cast<unsigned char*>(row.data());
    JSAMPROW out = has_ink() ? inks_.data() : samples;
    if (!run([&] { jpeg_read_scanlines(&jpeg_, &out, 1); })) return false;
    // Adobe's programs, which write such files, store what is left of the light.
    for (std::size_t i = 0; i < row.size() && has_ink(); ++i) {
      const unsigned ink = inks_[i / 3 * 4 + i % 3];
      samples[i] = static_cast<unsigned char>((ink * inks_[i / 3 * 4 + 3] + 127) / 255);
    }
    return true;
  }

  [[nodiscard]] bool read_picture(std::span<std::byte> /*picture*/, const PngHeader& /*header*/) override {
    return false;
  }

  [[nodiscard]] bool finish() override {
    return run([&] { jpeg_finish_decompress(&jpeg_); });
  }

 private:
  /// Runs calls of libjpeg, which leaves a failed one by longjmp: they hold nothing but trivial objects.
  template <typename Calls>
  [[nodiscard]] bool run(Calls calls) {
    if (setjmp(errors_.jump) != 0) return fail(errors_.text.data());  // NOLINT(cert-err52-cpp)
    calls();
    return true;
  }

  [[nodiscard]] bool has_ink() const { return jpeg_.num_components == 4; }

  [[nodiscard]] bool read_header(PngHeader& header) override {
    jpeg_destroy_decompress(&jpeg_);
    jpeg_.err = &errors_.base;
    const bool is_read = run([&] {
      jpeg_create_decompress(&jpeg_);
      jpeg_stdio_src(&jpeg_, file());
      jpeg_save_markers(&jpeg_, kExif, 0xFFFF);
      jpeg_read_header(&jpeg_, TRUE);
    });
    if (!is_read) return false;
    header.width = jpeg_.image_width;
    header.height = jpeg_.image_height;
    header.bit_depth = 8;
    header.channels.resize(has_ink() ? 3 : static_cast<std::size_t>(jpeg_.num_components));
    header.row_bytes = header.width * header.channels.size();
    return true;
  }

  JpegErrors errors_;
  jpeg_decompress_struct jpeg_{};
  std::vector<unsigned char> inks_;  ///< a row of CMYK
};

}  // namespace

std::unique_ptr<PhotoRows> open_jpeg_rows(PhotoInfo& info) {
  info.format = "jpeg";
  auto decoder = std::make_unique<JpegDecoder>();
  const JpegDecoder& opened = *decoder;
  auto rows = std::make_unique<DecodedRows>(info, "JPEG", std::move(decoder));
  note_orientation(opened.orientation(), info);
  return rows;
}

}  // namespace isohf
