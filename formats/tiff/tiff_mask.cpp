#include "formats/tiff/tiff_mask.h"

#include <fmt/format.h>

#include <optional>
#include <vector>

#include "formats/binary_grids/turned_rows.h"
#include "formats/files/raw_file.h"
#include "formats/tiff/tiff_blocks.h"
#include "formats/tiff/tiff_file.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Rows of bits are rows of bytes, each of up to eight pixels: blocks begin at whole bytes.
TiffLayout layout_of_bytes(TiffLayout layout) {
  if (layout.bits_per_sample == 1) {
    layout.width = (layout.width + 7) / 8;
    layout.block_width = (layout.block_width + 7) / 8;
    layout.bits_per_sample = 8;
  }
  return layout;
}

class TiffMask final : public HeightSource {
 public:
  TiffMask(const std::string& path, std::uint32_t directory, bool rows_from_south)
      : file_(path), rows_from_south_(rows_from_south) {
    TiffMainImage image = open_image(file_, directory);
    const TiffLayout layout = image.handle->read_layout();
    const bool is_read = layout.samples_per_pixel == 1 && (layout.bits_per_sample == 1 || layout.bits_per_sample == 8);
    if (!is_read) {
      throw Error(
          ErrorCode::kUnsupported,
          fmt::format(
              "{}: the transparency mask has {} samples of {} bits a pixel, must have one of 1 or 8; --channel 0 "
              "reads the image without it",
              path, layout.samples_per_pixel, layout.bits_per_sample));
    }
    info_.path = path;
    info_.format = "TIFF transparency mask";
    info_.width = layout.width;
    info_.height = layout.height;
    info_.sample_type = SampleType::kUint8;
    has_bits_ = layout.bits_per_sample == 1;
    blocks_.emplace(file_, layout_of_bytes(layout), std::move(image), 0);
    info_.block_width = layout.block_width;
    info_.block_height = blocks_->unit_rows();
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const Window stored = rows_from_south_ ? turned(window, info_.height) : window;
    if (has_bits_) {
      read_bits(stored, samples);
    } else {
      blocks_->read(stored, samples);
    }
    if (rows_from_south_) turn_rows(samples, static_cast<std::size_t>(window.columns));
  }

  void limit_buffers(std::uint64_t bytes) override {
    if (!rows_from_south_) blocks_->limit_cache(bytes);
  }
  [[nodiscard]] std::uint64_t buffer_bytes(std::uint64_t limit) const override {
    return blocks_->cache_bytes(rows_from_south_ ? UINT64_MAX : limit);
  }

 private:
  void read_bits(const Window& window, std::span<std::byte> samples) {
    const std::int64_t first = window.column / 8;
    const std::int64_t bytes = (window.column + window.columns + 7) / 8 - first;
    bits_.resize(static_cast<std::size_t>(bytes * window.rows));
    blocks_->read({first, window.row, bytes, window.rows}, bits_);
    std::byte* out = samples.data();
    for (std::int64_t row = 0; row < window.rows; ++row) {
      const std::byte* const in = bits_.data() + row * bytes;
      for (std::int64_t i = window.column - 8 * first; i < window.column - 8 * first + window.columns; ++i) {
        *out++ = in[i / 8] >> (7 - i % 8) & std::byte{1};
      }
    }
  }

  RawFile file_;
  SourceInfo info_;
  bool rows_from_south_;
  bool has_bits_ = false;
  std::optional<TiffBlocks> blocks_;
  std::vector<std::byte> bits_;
};

}  // namespace

std::unique_ptr<HeightSource> open_tiff_mask(const std::string& path, std::uint32_t directory, bool rows_from_south) {
  return std::make_unique<TiffMask>(path, directory, rows_from_south);
}

}  // namespace isohf
