#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "isohf/light/normals.h"
#include "isohf/shade.h"

namespace isohf {

/// Linear light, red, green, blue; 1 is white.
using Light = std::array<float, 3>;

/// Colours of the ground by elevation.
class Palette {
 public:
  /// At least one stop; elevations rise. Beyond the first and last their colours go on.
  explicit Palette(std::vector<ColourStop> stops) : stops_(std::move(stops)) {}
  [[nodiscard]] Light at(double elevation) const;

 private:
  std::vector<ColourStop> stops_;
};

/// Sun and sky over a landscape: how much light falls on a piece of ground, and what a picture shows of it.
class Illumination {
 public:
  /// air  has_air()
  Illumination(double sun_azimuth_deg, double sun_elevation_deg, bool air);

  /// Light that falls on ground with that normal where `sun_share` of the sun is seen.
  [[nodiscard]] Light on(const Normal& normal, float sun_share) const;

 private:
  Normal towards_;
  Light sun_;
  Light sky_;
};

/// A picture's value, 0 to 255, of linear light: a film's shoulder for what is brighter than the ground in full sun,
/// then sRGB.
[[nodiscard]] std::uint8_t value_from_light(float light);

}  // namespace isohf
