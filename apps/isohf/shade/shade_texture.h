#pragma once

#include "isohf/archive/textures/texture_reader.h"
#include "shade/shade_light.h"

namespace isohf::cli {

/// The colours of an archive's textures, for places that lie a given distance apart.
class ShadeTexture {
 public:
  /// step_x, step_z  world units between the places that colours are asked for. Throws as TextureReader does.
  ShadeTexture(const ArchiveReader& archive, double step_x, double step_z);

  /// Linear light, and how much of the ground it covers.
  struct Colour {
    Light light{};
    float alpha = 0.0F;
  };

  /// One tile's texture, from the mip level whose texels are no larger than the steps.
  class Tile {
   public:
    Tile() = default;
    Tile(Picture rgba, int finest_size) : picture_(std::move(rgba)), finest_size_(finest_size) {}
    /// s, t  0...1 from West to East and North to South, interpolated linearly; nothing where the tile has no texture.
    [[nodiscard]] Colour at(double s, double t) const;

   private:
    Picture picture_;
    int finest_size_ = 0;
  };
  /// Any thread.
  [[nodiscard]] Tile read(TileIndex tile) const;

 private:
  TextureReader reader_;
  int level_ = 0;
};

}  // namespace isohf::cli
