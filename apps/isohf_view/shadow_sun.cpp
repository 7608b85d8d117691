#include "shadow_sun.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace isohf::view {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
/// A sun that stands higher than this in the rows' plane shades nothing to speak of.
constexpr double kOverhead_deg = 89.5;
/// Suns closer together than this are one to the eye; the sun itself is half a degree wide.
constexpr double kSame_deg = 0.01;

double nearest_of(const ShadowSeedInfo& seeds, double wanted_deg) {
  if (seeds.kind == ShadowSeedInfo::Kind::kHulls) return std::max(wanted_deg, seeds.sun_min_deg);
  return *std::min_element(seeds.sun_deg.begin(), seeds.sun_deg.end(),
                           [&](double a, double b) { return std::abs(a - wanted_deg) < std::abs(b - wanted_deg); });
}

}  // namespace

ShadowSun shadow_sun(const ShadowSeedInfo* seeds, double azimuth_deg, double elevation_deg, double exaggeration) {
  ShadowSun out;
  if (seeds == nullptr) return out;
  out.state = ShadowSun::State::kNone;
  if (elevation_deg <= 0.0 || elevation_deg >= 90.0) return out;
  const double eastward = std::sin(azimuth_deg * kDegree);
  const double rise = std::tan(elevation_deg * kDegree);
  const double wanted_deg = std::atan2(rise / exaggeration, std::abs(eastward)) / kDegree;
  if (std::atan2(rise, std::abs(eastward)) / kDegree > kOverhead_deg || wanted_deg > kOverhead_deg) return out;
  out.sun.travel = eastward > 0.0 ? LightTravel::kWestward : LightTravel::kEastward;
  out.sun.elevation_deg = nearest_of(*seeds, wanted_deg);
  const bool exact = std::abs(out.sun.elevation_deg - wanted_deg) < kSame_deg;
  out.state = exact ? ShadowSun::State::kExact : ShadowSun::State::kNearest;
  out.seen_deg = std::atan(std::tan(out.sun.elevation_deg * kDegree) * exaggeration) / kDegree;
  return out;
}

}  // namespace isohf::view
