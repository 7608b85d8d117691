#pragma once

#include <cstdint>
#include <span>

#include "isohf/light/normals.h"

namespace isohf {

/// Three rows of heights around the one that is drawn, each with a height before its first pixel and one behind its
/// last: [-1...width]. NaN is void, and counts as level with the pixel in the middle.
struct ReliefRows {
  const float* north;
  const float* here;
  const float* south;
};

/// Horn's slopes, as GDAL takes them, in pixels of a given size. world units
struct PixelSize {
  double x;
  double z;
};

/// A unit vector towards the sun: x East, y up, z South. azimuth clockwise from North.
[[nodiscard]] Normal towards_sun(double azimuth_deg, double elevation_deg);

/// Writes one row; `out` holds the row's width. Shares are 0 to 1; NaN where the pixel is void.
void relief_hillshade(const ReliefRows& rows, const PixelSize& pixel, const Normal& sun, std::span<float> out);
/// Unit normals, [3 * width]: all x, all y, all z.
void relief_normals(const ReliefRows& rows, const PixelSize& pixel, std::span<float> out);

/// Shares as bytes, 1 to 255, and 0 where NaN.
void bytes_from_shares(std::span<const float> shares, std::span<std::uint8_t> bytes);

}  // namespace isohf
