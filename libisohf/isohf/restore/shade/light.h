#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "isohf/shade.h"
#include "isohf/surface/shade/normals.h"

namespace isohf {

/// Linear light, red, green, blue; 1 is white.
using Light = std::array<float, 3>;

/// Colours of the ground by elevation.
class Palette {
 public:
  /// The colours run from `low` to `high`, elevation units; at least one of any two elevations apart where they are
  /// equal.
  Palette(ShadePalette name, double low, double high);
  [[nodiscard]] const Light& at(double elevation) const;

 private:
  double low_;
  double per_unit_;
  std::vector<Light> colours_;
};

/// Sun and sky over a landscape: how much light falls on a piece of ground, and what a picture shows of it.
class Illumination {
 public:
  Illumination(SunSide side, double sun_elevation_deg, bool hillshade);

  /// Light that falls on ground with that normal where `sun_share` of the sun is seen.
  [[nodiscard]] Light on(const Normal& normal, double sun_share) const;

 private:
  bool hillshade_;
  float sun_x_;
  float sun_y_;
  Light sun_;
  Light sky_;
};

/// A picture's value, 0 to 255, of linear light: a film's shoulder for what is brighter than the ground in full sun,
/// then sRGB.
[[nodiscard]] std::uint8_t value_from_light(float light);

}  // namespace isohf
