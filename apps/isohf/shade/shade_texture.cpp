#include "shade/shade_texture.h"

#include <algorithm>
#include <cmath>

#include "isohf/surface/photo/srgb.h"

namespace isohf::cli {

ShadeTexture::ShadeTexture(const ArchiveReader& archive, double step_x, double step_z) : reader_(archive) {
  const TileGrid& grid = archive.grid();
  const double texels = std::min(step_x / grid.extent_x(), step_z / grid.extent_z()) * (reader_.info().size - 1);
  const double last = reader_.info().levels - 1;
  level_ = static_cast<int>(std::clamp(std::floor(std::log2(std::max(texels, 1e-9)) + 1e-6), 0.0, last));
}

ShadeTexture::Tile ShadeTexture::read(TileIndex tile) const {
  if (!reader_.has(tile)) return {};
  return {reader_.read_rgba(tile, level_), reader_.info().size};
}

ShadeTexture::Colour ShadeTexture::Tile::at(double s, double t) const {
  Colour colour;
  if (picture_.samples.empty()) return colour;
  // docs/archive_format.md, section 12: one texture coordinate for all levels.
  const auto place = [this](double along) {
    const double u = (0.5 + (finest_size_ - 1) * along) / finest_size_;
    return std::clamp(u * picture_.width - 0.5, 0.0, picture_.width - 1.0);
  };
  const double x = place(s);
  const double y = place(t);
  const auto column = std::min(static_cast<int>(x), picture_.width - 2);
  const auto row = std::min(static_cast<int>(y), picture_.height - 2);
  const auto right = static_cast<float>(x - column);
  const auto down = static_cast<float>(y - row);
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const std::uint8_t* const texel = picture_.pixel(column + i, row + j);
      const float alpha = static_cast<float>(texel[3]) / 255.0F;
      const float weight = (i == 0 ? 1.0F - right : right) * (j == 0 ? 1.0F - down : down) * alpha;
      for (std::size_t c = 0; c < 3; ++c) colour.light[c] += weight * linear_from_srgb()[texel[c]];
      colour.alpha += weight;
    }
  }
  if (colour.alpha > 0.0F) {
    for (float& value : colour.light) value /= colour.alpha;
  }
  return colour;
}

}  // namespace isohf::cli
