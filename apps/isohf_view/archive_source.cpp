#include "tile_source.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "isohf/archive/reader.h"
#include "isohf/base/assert.h"

namespace isohf::view {
namespace {

class ArchiveSource final : public TileSource {
 public:
  explicit ArchiveSource(const std::string& path) : reader_(path) {
    const Metadata& metadata = reader_.metadata();
    if (metadata.quantisation.type != CodeType::kF32) {
      scale_ = {metadata.quantisation.offset, metadata.quantisation.scale};
      return;
    }
    // Floats on the GPU would be four bytes a vertex: round them to 65535 steps over the dataset's range.
    const double low = metadata.statistics.min.value_or(0.0);
    const double high = metadata.statistics.max.value_or(0.0);
    scale_ = {low, high > low ? (high - low) / (kVoidCode - 1) : 1.0};
  }

  [[nodiscard]] const TileGrid& grid() const override { return reader_.grid(); }
  [[nodiscard]] ViewScale scale() const override { return scale_; }

  [[nodiscard]] WorldBounds covered() const override { return reader_.metadata().valid; }

  [[nodiscard]] TileBounds bounds(TileIndex tile) const override {
    const TileEntry entry = reader_.tile_entry(tile);
    if (!entry.stored) return {};
    if (reader_.metadata().quantisation.type == CodeType::kF32) {
      return {true, entry.has_voids, std::bit_cast<float>(entry.code_min), std::bit_cast<float>(entry.code_max)};
    }
    return {true, entry.has_voids, scale_.offset + scale_.scale * entry.code_min,
            scale_.offset + scale_.scale * entry.code_max};
  }

  void read(TileIndex tile, std::span<std::uint16_t> codes) const override {
    const TileCodes stored = reader_.read_tile(tile);
    if (stored.type == CodeType::kF32) {
      ISOHF_ASSERT(stored.heights.size() == codes.size());
      std::transform(stored.heights.begin(), stored.heights.end(), codes.begin(), [this](float height) {
        if (std::isnan(height)) return kVoidCode;
        const double code = std::round((height - scale_.offset) / scale_.scale);
        return static_cast<std::uint16_t>(std::clamp(code, 0.0, kVoidCode - 1.0));
      });
      return;
    }
    ISOHF_ASSERT(stored.codes.size() == codes.size());
    const std::uint32_t void_code = reader_.metadata().quantisation.void_code();
    std::transform(stored.codes.begin(), stored.codes.end(), codes.begin(),
                   [=](std::uint16_t code) { return code == void_code ? kVoidCode : code; });
  }

 private:
  ArchiveReader reader_;
  ViewScale scale_;
};

}  // namespace

std::unique_ptr<TileSource> open_archive(const std::string& path) {
  return std::make_unique<ArchiveSource>(path);
}

}  // namespace isohf::view
