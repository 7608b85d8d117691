#include "isohf/light/relief.h"

#include <cmath>
#include <cstdint>
#include <numbers>

#include "isohf/base/simd.h"
#include "isohf/shade.h"

namespace isohf {
namespace {

struct Slope {
  float x;  ///< rise eastwards
  float z;  ///< rise southwards
};

ISOHF_KERNEL float known(float height, float here) {
  return height == height ? height : here;
}

ISOHF_KERNEL Slope slope_at(const float* north, const float* here, const float* south, int i, float per_x,
                            float per_z) {
  const float centre = here[i];
  const float nw = known(north[i - 1], centre);
  const float n = known(north[i], centre);
  const float ne = known(north[i + 1], centre);
  const float w = known(here[i - 1], centre);
  const float e = known(here[i + 1], centre);
  const float sw = known(south[i - 1], centre);
  const float s = known(south[i], centre);
  const float se = known(south[i + 1], centre);
  return {((ne - nw) + 2.0F * (e - w) + (se - sw)) * per_x, ((sw - nw) + 2.0F * (s - n) + (se - ne)) * per_z};
}

/// A void pixel's slopes are NaN, and so is all that follows.
ISOHF_KERNEL void hillshade(const float* north, const float* here, const float* south, int count, float per_x,
                            float per_z, float sun_x, float sun_y, float sun_z, float* __restrict out) {
  for (int i = 0; i < count; ++i) {
    const Slope slope = slope_at(north, here, south, i, per_x, per_z);
    const float towards = sun_y - slope.x * sun_x - slope.z * sun_z;
    const float share = towards / std::sqrt(1.0F + slope.x * slope.x + slope.z * slope.z);
    out[i] = share < 0.0F ? 0.0F : share;
  }
}

ISOHF_KERNEL void normals(const float* north, const float* here, const float* south, int count, float per_x,
                          float per_z, float* __restrict x, float* __restrict y, float* __restrict z) {
  for (int i = 0; i < count; ++i) {
    const Slope slope = slope_at(north, here, south, i, per_x, per_z);
    const float scale = 1.0F / std::sqrt(1.0F + slope.x * slope.x + slope.z * slope.z);
    x[i] = -slope.x * scale;
    y[i] = scale;
    z[i] = -slope.z * scale;
  }
}

ISOHF_KERNEL void to_bytes(const float* shares, int count, std::uint8_t* __restrict bytes) {
  for (int i = 0; i < count; ++i) {
    const float share = shares[i];
    const bool is_known = share == share;
    bytes[i] = static_cast<std::uint8_t>(static_cast<int>(is_known ? 1.5F + 254.0F * share : 0.0F));
  }
}

float per_x(const PixelSize& pixel) {
  return static_cast<float>(1.0 / (8.0 * pixel.x));
}
float per_z(const PixelSize& pixel) {
  return static_cast<float>(1.0 / (8.0 * pixel.z));
}

}  // namespace

Normal towards_sun(double azimuth_deg, double elevation_deg) {
  const double azimuth = azimuth_deg * std::numbers::pi / 180.0;
  const double elevation = elevation_deg * std::numbers::pi / 180.0;
  return {static_cast<float>(std::sin(azimuth) * std::cos(elevation)), static_cast<float>(std::sin(elevation)),
          static_cast<float>(-std::cos(azimuth) * std::cos(elevation))};
}

void relief_hillshade(const ReliefRows& rows, const PixelSize& pixel, const Normal& sun, std::span<float> out) {
  vectorised<hillshade>(rows.north, rows.here, rows.south, static_cast<int>(out.size()), per_x(pixel), per_z(pixel),
                        sun.x, sun.y, sun.z, out.data());
}

void relief_normals(const ReliefRows& rows, const PixelSize& pixel, std::span<float> out) {
  const std::size_t width = out.size() / 3;
  vectorised<normals>(rows.north, rows.here, rows.south, static_cast<int>(width), per_x(pixel), per_z(pixel),
                      out.data(), out.data() + width, out.data() + 2 * width);
}

void bytes_from_shares(std::span<const float> shares, std::span<std::uint8_t> bytes) {
  vectorised<to_bytes>(shares.data(), static_cast<int>(shares.size()), bytes.data());
}

}  // namespace isohf
