#include <fmt/format.h>

#include <cstring>
#include <vector>

#include "formats/photo/photo.h"
#include "formats/png/png_decoder.h"
#include "formats/readers.h"
#include "isohf/error.h"

namespace isohf {
namespace {

class PngRows final : public PhotoRows {
 public:
  explicit PngRows(PhotoInfo& info) : path_(info.path) {
    restart();
    const std::uint64_t picture_bytes = std::uint64_t{header_.row_bytes} * header_.height;
    if (header_.interlaced && picture_bytes > kMaxInterlacedBytes) {
      throw Error(ErrorCode::kUnsupported,
                  fmt::format("interlaced PNG of {} x {} pixels would take more than {} MiB; store it without "
                              "interlacing",
                              header_.width, header_.height, kMaxInterlacedBytes >> 20U));
    }
    channels_ = static_cast<int>(header_.channels.size());
    info.format = "png";
    info.width = header_.width;
    info.height = header_.height;
    info.channels = photo_channels(channels_, channels_ - 1, info);
  }

  void read(std::int64_t row, std::int64_t rows, std::span<std::uint8_t> samples) override {
    const std::size_t out_bytes = samples.size() / static_cast<std::size_t>(rows);
    for (std::int64_t i = 0; i < rows; ++i) {
      const SampleType type = header_.bit_depth == 16 ? SampleType::kUint16 : SampleType::kUint8;
      photo_samples(type, decoded(row + i), channels_, channels_, false,
                    samples.subspan(static_cast<std::size_t>(i) * out_bytes, out_bytes));
    }
  }

 private:
  void restart() {
    next_row_ = 0;
    if (!decoder_.open(path_, header_) || !decoder_.start(header_, PngDecoder::For::kPicture)) {
      throw Error(decoder_.has_file() ? ErrorCode::kCorrupt : ErrorCode::kIo,
                  fmt::format("PNG header: {}", decoder_.message()));
    }
  }

  std::span<const std::byte> decoded(std::int64_t row) {
    if (header_.interlaced) {
      if (bytes_.empty()) {
        bytes_.resize(header_.row_bytes * header_.height);
        if (!decoder_.read_picture(bytes_, header_) || !decoder_.finish()) fail("interlaced PNG");
      }
      return std::span(bytes_).subspan(static_cast<std::size_t>(row) * header_.row_bytes, header_.row_bytes);
    }
    if (row < next_row_) restart();
    bytes_.resize(header_.row_bytes);
    for (; next_row_ <= row; ++next_row_) {
      const bool last = next_row_ + 1 == static_cast<std::int64_t>(header_.height);
      if (!decoder_.read_row(bytes_) || (last && !decoder_.finish())) fail(fmt::format("PNG row {}", next_row_));
    }
    return bytes_;
  }

  /// The decoder cannot go on after an error: the next row, whichever, begins again.
  [[noreturn]] void fail(const std::string& where) {
    next_row_ = INT64_MAX;
    bytes_.clear();
    throw Error(ErrorCode::kCorrupt, fmt::format("{}: {}", where, decoder_.message()));
  }

  std::string path_;
  PngDecoder decoder_;
  PngHeader header_;
  int channels_ = 0;
  std::int64_t next_row_ = 0;
  std::vector<std::byte> bytes_;  ///< the row decoded last; of an interlaced picture all
};

}  // namespace

std::unique_ptr<PhotoRows> open_png_rows(PhotoInfo& info) {
  return std::make_unique<PngRows>(info);
}

}  // namespace isohf
