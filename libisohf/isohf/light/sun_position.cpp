#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "isohf/error.h"
#include "isohf/shade.h"

namespace isohf {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

double sine(double degrees) {
  return std::sin(degrees * kDegree);
}
double cosine(double degrees) {
  return std::cos(degrees * kDegree);
}
double within_half_turn(double degrees) {
  return std::remainder(degrees, 360.0);
}

/// Days since noon of 1 January 2000, of a day's midnight in the Gregorian calendar.
double days_since_2000(const SolarTime& time) {
  const int from_march = (time.month + 9) % 12;
  const std::int64_t year = time.year - (time.month < 3 ? 1 : 0);
  const auto floor_of = [](std::int64_t value, std::int64_t by) { return (value - ((value % by) + by) % by) / by; };
  const std::int64_t days = 365 * year + floor_of(year, 4) - floor_of(year, 100) + floor_of(year, 400) +
                            (153 * from_march + 2) / 5 + time.day - 1;
  constexpr std::int64_t kOfJanuary2000 = 730425;
  return static_cast<double>(days - kOfJanuary2000) - 0.5;
}

/// What the season makes of the sun, degrees.
struct Season {
  double declination;
  double equation_of_time;  ///< by how far the sun is ahead of the mean one
};

/// The Astronomical Almanac's low-precision formulae: within 0.01 degrees from 1950 to 2050.
Season on_earth(double days) {
  const double mean = 280.460 + 0.9856474 * days;
  const double anomaly = 357.528 + 0.9856003 * days;
  const double longitude = mean + 1.915 * sine(anomaly) + 0.020 * sine(2.0 * anomaly);
  const double tilt = 23.439 - 4e-7 * days;
  const double ascension = std::atan2(cosine(tilt) * sine(longitude), cosine(longitude)) / kDegree;
  return {std::asin(sine(tilt) * sine(longitude)) / kDegree, within_half_turn(mean - ascension)};
}

/// Allison and McEwen (2000), without the planets' pulls: within 0.02 degrees.
Season on_mars(double days) {
  const double anomaly = 19.3871 + 0.52402073 * days;
  const double centre = (10.691 + 3e-7 * days) * sine(anomaly) + 0.623 * sine(2.0 * anomaly) +
                        0.050 * sine(3.0 * anomaly) + 0.005 * sine(4.0 * anomaly) + 0.0005 * sine(5.0 * anomaly);
  const double longitude = 270.3871 + 0.524038496 * days + centre;
  return {std::asin(0.42565 * sine(longitude)) / kDegree + 0.25 * sine(longitude),
          2.861 * sine(2.0 * longitude) - 0.071 * sine(4.0 * longitude) + 0.002 * sine(6.0 * longitude) - centre};
}

[[noreturn]] void refuse(const ArchiveReader& archive, const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, archive.path() + ": `date`: " + why);
}

}  // namespace

DaySky::DaySky(const ArchiveReader& archive) {
  const std::string& body = archive.metadata().source.body;
  if (body.empty()) refuse(archive, "the archive does not say which body it shows");
  if (body != "Earth" && body != "Mars") refuse(archive, "the sun's way is known for Earth and Mars, not for " + body);
  is_mars_ = body == "Mars";
  const WorldGeoreference places(archive.metadata());
  if (!places.has_geo()) refuse(archive, "the archive has no place in longitude and latitude");
  const WorldBounds& covered = archive.metadata().valid;
  const WorldPoint middle{0.5 * (covered.x0 + covered.x1), 0.5 * (covered.z0 + covered.z1)};
  place_ = places.geo_from_world(middle);
  if (!std::isfinite(place_.latitude)) refuse(archive, "the archive's middle has no place in longitude and latitude");
  // Where North is on the map.
  constexpr double kStep_deg = 1e-4;
  const double sign = place_.latitude > 0.0 ? -1.0 : 1.0;
  const WorldPoint there = places.world_from_geo({place_.longitude, place_.latitude + sign * kStep_deg});
  const double x = sign * (there.x - middle.x);
  const double z = sign * (there.z - middle.z);
  if (std::isfinite(x) && std::isfinite(z)) north_deg_ = std::atan2(x, -z) / kDegree;
}

SunPlace DaySky::sun(const SolarTime& time) const {
  // Beyond these no calendar goes, and nothing that is computed here holds.
  if (!std::isfinite(time.hours) || std::abs(time.year) > 9999 || time.month < 1 || time.month > 12 || time.day < 1 ||
      time.day > 31) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("`date`: there is no {}-{}-{} and {} hours", time.year, time.month, time.day, time.hours));
  }
  const double days = days_since_2000(time) + (time.hours - place_.longitude / 15.0) / 24.0;
  const Season season = is_mars_ ? on_mars(days) : on_earth(days);
  const double hour_angle = (time.hours - 12.0) * 15.0 + season.equation_of_time;
  const double latitude = place_.latitude;
  const double rise =
      sine(latitude) * sine(season.declination) + cosine(latitude) * cosine(season.declination) * cosine(hour_angle);
  const double east = -cosine(season.declination) * sine(hour_angle);
  const double north =
      sine(season.declination) * cosine(latitude) - cosine(season.declination) * sine(latitude) * cosine(hour_angle);
  const double azimuth = std::atan2(east, north) / kDegree + north_deg_;
  return {azimuth - 360.0 * std::floor(azimuth / 360.0), std::asin(std::clamp(rise, -1.0, 1.0)) / kDegree};
}

}  // namespace isohf
