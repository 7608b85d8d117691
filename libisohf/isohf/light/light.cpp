#include "isohf/light/light.h"

#include <algorithm>
#include <cmath>

#include "isohf/base/handed_in.h"
#include "isohf/light/relief.h"
#include "isohf/photo/srgb.h"

namespace isohf {
namespace {

struct Stop {
  double at;  ///< share of the elevation range
  std::uint8_t srgb[3];
};

/// Meadows, dry grass, earth, rock, snow; chosen by eye.
constexpr Stop kElevationStops[] = {
    {0.00, {104, 140, 102}}, {0.14, {146, 170, 116}}, {0.30, {198, 198, 142}}, {0.46, {212, 184, 132}},
    {0.62, {182, 146, 110}}, {0.77, {160, 136, 122}}, {0.89, {196, 188, 184}}, {1.00, {250, 250, 252}},
};
/// From the deepest to the shore.
constexpr Stop kSeaStops[] = {{0.0, {44, 76, 118}}, {0.6, {72, 116, 156}}, {1.0, {134, 174, 196}}};
constexpr double kLeastDepth = 10.0;  ///< that has the deepest one's colour
constexpr double kLeastLand = 1e-3;
constexpr Stop kGrayStops[] = {{0.0, {150, 150, 150}}, {1.0, {225, 225, 225}}};
/// Dark plains, rust, bright dust.
constexpr Stop kMarsStops[] = {{0.00, {104, 72, 60}},
                               {0.25, {150, 94, 66}},
                               {0.50, {184, 120, 80}},
                               {0.75, {208, 154, 108}},
                               {1.00, {234, 204, 166}}};

template <std::size_t N>
void append(const Stop (&stops)[N], double low, double high, std::vector<ColourStop>& out) {
  for (const Stop& stop : stops) {
    out.push_back({low + stop.at * (high - low), stop.srgb[0], stop.srgb[1], stop.srgb[2]});
  }
}

bool is_on(const Metadata& metadata, const char* body) {
  return metadata.source.body == body;
}

}  // namespace

bool has_air(const Metadata& metadata) {
  return metadata.source.body.empty() || is_on(metadata, "Earth") || is_on(metadata, "Venus") ||
         is_on(metadata, "Mars") || is_on(metadata, "Titan");
}

std::vector<ColourStop> shade_colours(const Metadata& metadata, std::optional<ShadePalette> palette) {
  require_known("the palette", palette.value_or(ShadePalette::kElevation), ShadePalette::kMars);
  const double low = metadata.statistics.min.value_or(0.0);
  const double high = std::max(metadata.statistics.max.value_or(0.0), low);
  const bool is_earth = is_on(metadata, "Earth");
  if (!palette) {
    const bool is_other = !metadata.source.body.empty() && !is_earth;
    palette = !is_other                 ? ShadePalette::kElevation
              : is_on(metadata, "Mars") ? ShadePalette::kMars
                                        : ShadePalette::kGray;
  }
  std::vector<ColourStop> stops;
  switch (*palette) {
    case ShadePalette::kElevation: {
      // 0 is the sea, and what rounds to it; shallows are bright.
      const Quantisation& codes = metadata.quantisation;
      const double rounding = codes.type == CodeType::kF32 ? kLeastLand : 0.5 * codes.scale;
      const double shore = std::min(rounding, 0.5 * high);
      const bool has_sea = is_earth && low <= 0.0;
      if (has_sea) append(kSeaStops, std::min(low, -kLeastDepth), std::max(shore, 0.0), stops);
      if (!has_sea || high > 0.0) append(kElevationStops, has_sea ? shore : low, high, stops);
      break;
    }
    case ShadePalette::kGray:
      append(kGrayStops, low, high, stops);
      break;
    case ShadePalette::kMars:
      append(kMarsStops, low, high, stops);
      break;
  }
  return stops;
}

Light Palette::at(double elevation) const {
  // At an elevation with two colours the second begins.
  const auto behind = std::upper_bound(stops_.begin(), stops_.end(), elevation,
                                       [](double value, const ColourStop& stop) { return value < stop.elevation; });
  const auto i = static_cast<std::size_t>(behind - stops_.begin());
  const ColourStop& low = stops_[i == 0 ? 0 : i - 1];
  const ColourStop& high = stops_[std::min(i, stops_.size() - 1)];
  const double range = high.elevation - low.elevation;
  const auto share = static_cast<float>(range > 0.0 ? (elevation - low.elevation) / range : 0.0);
  const auto blend = [share](std::uint8_t from, std::uint8_t to) {
    const float value = static_cast<float>(from) + share * static_cast<float>(to - from);
    const auto whole = std::min(static_cast<std::size_t>(value), std::size_t{254});
    const float first = linear_from_srgb()[whole];
    return first + (value - static_cast<float>(whole)) * (linear_from_srgb()[whole + 1] - first);
  };
  return {blend(low.red, high.red), blend(low.green, high.green), blend(low.blue, high.blue)};
}

Illumination::Illumination(double sun_azimuth_deg, double sun_elevation_deg, bool air)
    : towards_(towards_sun(sun_azimuth_deg, sun_elevation_deg)) {
  // A real sun near the horizon leaves flat ground dark. The exposure follows it, though not all the way, so that a
  // morning stays a morning: flat ground gets sin^0.35 of what a high sun gives it.
  const double exposure = 1.5 / std::pow(static_cast<double>(towards_.y), 0.65);
  // Warm when low: the air takes blue and green, less from 30 degrees on.
  const double warmth = std::exp(-sun_elevation_deg / 12.0);
  const double colour[3] = {1.0, 0.965 - 0.26 * warmth, 0.90 - 0.52 * warmth};
  constexpr double kSky[3] = {0.19, 0.25, 0.36};
  constexpr double kGroundAround = 0.22;  // what lights shadows where no sky does
  for (std::size_t k = 0; k < 3; ++k) {
    sun_[k] = static_cast<float>(exposure * (air ? colour[k] : 0.95));
    sky_[k] = static_cast<float>(air ? kSky[k] : kGroundAround);
  }
}

Light Illumination::on(const Normal& normal, float sun_share) const {
  const float facing = std::max(0.0F, normal.x * towards_.x + normal.y * towards_.y + normal.z * towards_.z);
  // Light of the sky comes from everywhere, somewhat more of it from the North-West, as on hill-shaded maps, so that
  // land in the shadow keeps its shape.
  constexpr float kSkyX = -0.44F;
  constexpr float kSkyY = 0.78F;
  constexpr float kSkyZ = -0.44F;
  const float towards = normal.x * kSkyX + normal.y * kSkyY + normal.z * kSkyZ;
  const float open = 0.3F + 0.9F * std::max(0.0F, towards);
  const float direct = facing * sun_share;
  Light light{};
  for (std::size_t k = 0; k < 3; ++k) light[k] = sun_[k] * direct + sky_[k] * open;
  return light;
}

std::uint8_t value_from_light(float light) {
  constexpr int kSteps = 1 << 16;
  constexpr float kMost = 6.0F;  // 255 from there on
  static const std::vector<std::uint8_t> values = [] {
    std::vector<std::uint8_t> table;
    for (int i = 0; i <= kSteps; ++i) {
      const float from = (static_cast<float>(i) + 0.5F) * kMost / kSteps;
      // Straight up to 0.6, then ever flatter towards 1.
      const float knee = 0.6F;
      const float shown =
          from <= knee ? from : knee + (1.0F - knee) * (1.0F - std::exp(-(from - knee) / (1.0F - knee)));
      const float value = shown <= 0.0031308F ? 12.92F * shown : 1.055F * std::pow(shown, 1.0F / 2.4F) - 0.055F;
      table.push_back(static_cast<std::uint8_t>(std::clamp(value * 255.0F + 0.5F, 0.0F, 255.0F)));
    }
    return table;
  }();
  return values[static_cast<std::size_t>(std::clamp(light, 0.0F, kMost) * (kSteps / kMost))];
}

}  // namespace isohf
