#pragma once

#include <cmath>
#include <optional>

#include "gl/vec.h"

namespace isohf::view {

/// How the ground is coloured; the numbers are the terrain fragment shader's.
enum class ColourMode { kElevation = 0, kLevels = 1, kStrips = 2, kTexture = 3, kNormals = 4 };

/// All that a picture depends on besides the tiles.
struct ViewState {
  Vec3 eye;                       ///< world units; y as drawn, exaggeration included
  Vec3 forward{0.0, -0.5, -1.0};  ///< need not be a unit vector
  double fov_y_rad = 0.87;        ///< 50 degrees
  double far_distance = 1.0;      ///< world units, > 0
  Vec3 sun{-0.6, 0.6, -0.5};      ///< towards the sun; need not be a unit vector
  double exaggeration = 1.0;      ///< of elevations, > 0
  bool shadows = false;           ///< draws those that the tiles have
  ColourMode mode = ColourMode::kElevation;
  bool wireframe = false;
  std::optional<double> fixed_level;  ///< draws every tile at this fractional level
  double triangle_px = 4.0;           ///< area that triangles are meant to have, pixels (section 3.9)
  int width = 1280;                   ///< pixels
  int height = 720;

  /// Pixels of one world unit at distance 1.
  [[nodiscard]] double focal_px() const { return height / (2.0 * std::tan(fov_y_rad / 2.0)); }
};

/// A place in the picture: pixels from its top left corner.
struct PicturePoint {
  double x = 0.0;
  double y = 0.0;
};

/// Unit vector towards a sun at `azimuth_deg`, clockwise from North, `elevation_deg` above the horizon.
inline Vec3 sun_direction(double azimuth_deg, double elevation_deg) {
  const double radians = std::acos(-1.0) / 180.0;
  const double flat = std::cos(elevation_deg * radians);
  return {flat * std::sin(azimuth_deg * radians), std::sin(elevation_deg * radians),
          -flat * std::cos(azimuth_deg * radians)};
}

}  // namespace isohf::view
