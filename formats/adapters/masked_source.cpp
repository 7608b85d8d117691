#include "formats/adapters/masked_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <utility>
#include <vector>

#include "formats/mosaic/mosaic_samples.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// Read at once, unless a row has more.
constexpr std::int64_t kSamplesAtOnce = std::int64_t{1} << 18;

class MaskedSource final : public HeightSource {
 public:
  MaskedSource(std::unique_ptr<HeightSource> heights, std::unique_ptr<HeightSource> opacity)
      : heights_(std::move(heights)),
        opacity_(std::move(opacity)),
        info_(heights_->info()),
        stored_(SampleKind::of(info_)),
        samples_(choose_mosaic_samples({stored_}, true, nullptr)),
        opacity_bytes_(size_bytes(opacity_->info().sample_type)) {
    const SourceInfo& mask = opacity_->info();
    if (mask.width != info_.width || mask.height != info_.height) {
      throw Error(ErrorCode::kCorrupt, fmt::format("{}: the transparency mask has {} x {} samples, must have {} x {}",
                                                   info_.path, mask.width, mask.height, info_.width, info_.height));
    }
    if (samples_.kind.type != stored_.type) {
      info_.warnings.push_back(
          fmt::format("{} has no number to spare for transparent samples, which are voids; samples "
                      "become {} (`void_values` V gives them one, `channel` 0 reads the image without them)",
                      to_string(stored_.type), to_string(samples_.kind.type)));
    }
    samples_.kind.put_into(info_);
    info_.block_height = std::max(info_.block_height, mask.block_height);
  }

  [[nodiscard]] const SourceInfo& info() const override { return info_; }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    const std::int64_t rows_at_once =
        std::max<std::int64_t>(1, kSamplesAtOnce / std::max<std::int64_t>(1, window.columns));
    Window part = window;
    for (std::int64_t done = 0; done < window.rows; done += part.rows) {
      part.row = window.row + done;
      part.rows = std::min(rows_at_once, window.rows - done);
      const std::size_t part_bytes = static_cast<std::size_t>(part.columns * part.rows) * samples_.gap.size();
      read_part(part, samples.first(part_bytes));
      samples = samples.subspan(part_bytes);
    }
  }

  [[nodiscard]] std::uint64_t buffer_bytes() const override {
    const auto samples = static_cast<std::uint64_t>(std::max(kSamplesAtOnce, info_.width));
    return heights_->buffer_bytes() + opacity_->buffer_bytes() + samples * (size_bytes(stored_.type) + opacity_bytes_);
  }

 private:
  void read_part(const Window& window, std::span<std::byte> samples) {
    const auto count = static_cast<std::size_t>(window.columns * window.rows);
    if (stored_ == samples_.kind) {
      heights_->read_window(window, samples);
    } else {
      raw_.resize(count * size_bytes(stored_.type));
      heights_->read_window(window, raw_);
      convert_samples(stored_, raw_, samples_, samples);
    }
    mask_.resize(count * opacity_bytes_);
    opacity_->read_window(window, mask_);
    constexpr std::array<std::byte, 8> kTransparent = {};
    const std::size_t out_bytes = samples_.gap.size();
    for (std::size_t i = 0; i < count; ++i) {
      if (std::memcmp(mask_.data() + i * opacity_bytes_, kTransparent.data(), opacity_bytes_) != 0) continue;
      std::memcpy(samples.data() + i * out_bytes, samples_.gap.data(), out_bytes);
    }
  }

  std::unique_ptr<HeightSource> heights_;
  std::unique_ptr<HeightSource> opacity_;
  SourceInfo info_;
  SampleKind stored_;
  MosaicSamples samples_;
  std::size_t opacity_bytes_;
  std::vector<std::byte> raw_;
  std::vector<std::byte> mask_;
};

}  // namespace

std::unique_ptr<HeightSource> mask_transparent(std::unique_ptr<HeightSource> heights,
                                               std::unique_ptr<HeightSource> opacity) {
  return std::make_unique<MaskedSource>(std::move(heights), std::move(opacity));
}

}  // namespace isohf
