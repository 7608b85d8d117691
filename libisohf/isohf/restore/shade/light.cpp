#include "isohf/restore/shade/light.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace isohf {
namespace {

constexpr int kColours = 1024;

struct Stop {
  float at;       ///< share of the elevation range
  float srgb[3];  ///< 0 to 255
};

/// Meadows, dry grass, earth, rock, snow; chosen by eye.
constexpr Stop kElevationStops[] = {
    {0.00F, {104, 140, 102}}, {0.14F, {146, 170, 116}}, {0.30F, {198, 198, 142}}, {0.46F, {212, 184, 132}},
    {0.62F, {182, 146, 110}}, {0.77F, {160, 136, 122}}, {0.89F, {196, 188, 184}}, {1.00F, {250, 250, 252}},
};
constexpr Stop kGrayStops[] = {{0.0F, {150, 150, 150}}, {1.0F, {225, 225, 225}}};

float linear_from_srgb(float value) {
  const float v = value / 255.0F;
  return v <= 0.04045F ? v / 12.92F : std::pow((v + 0.055F) / 1.055F, 2.4F);
}

template <std::size_t N>
Light blend(const Stop (&stops)[N], float at) {
  std::size_t i = 1;
  while (i + 1 < N && at > stops[i].at) ++i;
  const float share = std::clamp((at - stops[i - 1].at) / (stops[i].at - stops[i - 1].at), 0.0F, 1.0F);
  Light light{};
  for (std::size_t k = 0; k < 3; ++k) {
    light[k] = linear_from_srgb(stops[i - 1].srgb[k] + share * (stops[i].srgb[k] - stops[i - 1].srgb[k]));
  }
  return light;
}

}  // namespace

Palette::Palette(ShadePalette name, double low, double high)
    : low_(low), per_unit_(high > low ? (kColours - 1) / (high - low) : 0.0) {
  for (int i = 0; i < kColours; ++i) {
    const float at = static_cast<float>(i) / (kColours - 1);
    colours_.push_back(name == ShadePalette::kElevation ? blend(kElevationStops, at) : blend(kGrayStops, at));
  }
}

const Light& Palette::at(double elevation) const {
  const double place = std::clamp((elevation - low_) * per_unit_ + 0.5, 0.0, kColours - 1.0);
  return colours_[static_cast<std::size_t>(place)];
}

Illumination::Illumination(SunSide side, double sun_elevation_deg, bool hillshade) : hillshade_(hillshade) {
  const double angle = sun_elevation_deg * std::numbers::pi / 180.0;
  sun_x_ = static_cast<float>(side == SunSide::kWest ? -std::cos(angle) : std::cos(angle));
  sun_y_ = static_cast<float>(std::sin(angle));
  // A real sun near the horizon leaves flat ground dark. The exposure follows it, though not all the way, so that a
  // morning stays a morning: flat ground gets sin^0.35 of what a high sun gives it.
  const double exposure = 1.5 / std::pow(std::sin(angle), 0.65);
  // Warm when low: the air takes blue and green, less from 30 degrees on.
  const double warmth = std::exp(-sun_elevation_deg / 12.0);
  const double colour[3] = {1.0, 0.965 - 0.26 * warmth, 0.90 - 0.52 * warmth};
  constexpr double kSky[3] = {0.19, 0.25, 0.36};
  for (std::size_t k = 0; k < 3; ++k) {
    sun_[k] = static_cast<float>(exposure * colour[k]);
    sky_[k] = static_cast<float>(kSky[k]);
  }
}

Light Illumination::on(const Normal& normal, double sun_share) const {
  // Without hill shading all ground is level ground.
  const float facing = hillshade_ ? std::max(0.0F, normal.x * sun_x_ + normal.y * sun_y_) : sun_y_;
  // Light of the sky comes from everywhere, somewhat more of it from the North-West, as on hill-shaded maps, so that
  // land in the shadow keeps its shape.
  constexpr float kSkyX = -0.44F;
  constexpr float kSkyY = 0.78F;
  constexpr float kSkyZ = -0.44F;
  const float towards = normal.x * kSkyX + normal.y * kSkyY + normal.z * kSkyZ;
  const float open = hillshade_ ? 0.3F + 0.9F * std::max(0.0F, towards) : 1.0F;
  const float direct = facing * static_cast<float>(sun_share);
  Light light{};
  for (std::size_t k = 0; k < 3; ++k) light[k] = sun_[k] * direct + sky_[k] * open;
  return light;
}

std::uint8_t value_from_light(float light) {
  // Straight up to 0.6, then ever flatter towards 1.
  const float knee = 0.6F;
  const float shown = light <= knee ? light : knee + (1.0F - knee) * (1.0F - std::exp(-(light - knee) / (1.0F - knee)));
  const float value = shown <= 0.0031308F ? 12.92F * shown : 1.055F * std::pow(shown, 1.0F / 2.4F) - 0.055F;
  return static_cast<std::uint8_t>(std::clamp(value * 255.0F + 0.5F, 0.0F, 255.0F));
}

}  // namespace isohf
