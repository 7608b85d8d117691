#include "isohf/projection/projection.h"

#include <fmt/format.h>

#include <GeographicLib/AzimuthalEquidistant.hpp>
#include <GeographicLib/Ellipsoid.hpp>
#include <GeographicLib/LambertConformalConic.hpp>
#include <GeographicLib/PolarStereographic.hpp>
#include <GeographicLib/TransverseMercator.hpp>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <type_traits>

#include "isohf/error.h"
#include "isohf/projection/reference_map.h"

namespace isohf {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();

/// In [-180, 180].
double normalised(double degrees) {
  return std::remainder(degrees, 360.0);
}

}  // namespace

double MapScale::error() const {
  return std::max(std::abs(most - 1.0), std::abs(least - 1.0));
}

/// One projection around longitude 0 with northing 0 at its own natural origin.
class Projection::Map {
 public:
  explicit Map(const ProjectionSpec& map_spec) : spec(map_spec) {}
  /// Throws where the parameters make no map.
  [[nodiscard]] static std::shared_ptr<const Map> make(const ProjectionSpec& spec);
  virtual ~Map() = default;
  Map(const Map&) = delete;
  Map& operator=(const Map&) = delete;

  [[nodiscard]] virtual MapPoint forward(double longitude, double latitude) const = 0;
  [[nodiscard]] virtual GeoPoint inverse(double x, double y) const = 0;
  [[nodiscard]] virtual MapScale scale(double longitude, double latitude) const = 0;

  const ProjectionSpec spec;

  class Equirectangular;
  class Local;
  class System;
  template <typename Library, typename Side>
  class Conformal;
};

class Projection::Map::Equirectangular final : public Map {
 public:
  explicit Equirectangular(const ProjectionSpec& map_spec)
      : Map(map_spec), degree_(degree_lengths(spec.ellipsoid, spec.latitude_0)) {}
  [[nodiscard]] MapPoint forward(double longitude, double latitude) const override {
    return {longitude * degree_.along_parallel, (latitude - spec.latitude_0) * degree_.along_meridian};
  }
  [[nodiscard]] GeoPoint inverse(double x, double y) const override {
    return {x / degree_.along_parallel, spec.latitude_0 + y / degree_.along_meridian};
  }
  [[nodiscard]] MapScale scale(double, double latitude) const override {
    const DegreeLengths here = degree_lengths(spec.ellipsoid, latitude);
    const double along_parallel = degree_.along_parallel / here.along_parallel;
    const double along_meridian = degree_.along_meridian / here.along_meridian;
    return {std::min(along_parallel, along_meridian), std::max(along_parallel, along_meridian)};
  }

 private:
  DegreeLengths degree_;
};

class Projection::Map::Local final : public Map {
 public:
  explicit Local(const ProjectionSpec& map_spec)
      : Map(map_spec), map_(GeographicLib::Geodesic(spec.ellipsoid.semi_major_axis_m, spec.ellipsoid.flattening())) {}
  [[nodiscard]] MapPoint forward(double longitude, double latitude) const override {
    MapPoint at;
    map_.Forward(spec.latitude_0, 0.0, latitude, longitude, at.easting, at.northing);
    return at;
  }
  [[nodiscard]] GeoPoint inverse(double x, double y) const override {
    GeoPoint at;
    map_.Reverse(spec.latitude_0, 0.0, x, y, at.latitude, at.longitude);
    return at;
  }
  [[nodiscard]] MapScale scale(double longitude, double latitude) const override {
    double x = 0.0;
    double y = 0.0;
    double azimuth = 0.0;
    double reciprocal = 1.0;
    map_.Forward(spec.latitude_0, 0.0, latitude, longitude, x, y, azimuth, reciprocal);
    // True to scale away from the centre, larger across.
    const double across = 1.0 / reciprocal;
    return {std::min(1.0, across), std::max(1.0, across)};
  }

 private:
  GeographicLib::AzimuthalEquidistant map_;
};

/// One of GeographicLib's conformal maps, whose functions are called alike. `Side` is what they take first: the
/// longitude in the middle, or whether the pole is the North one.
template <typename Library, typename Side>
class Projection::Map::Conformal final : public Map {
 public:
  Conformal(const ProjectionSpec& map_spec, const Library& map, Side side) : Map(map_spec), map_(map), side_(side) {
    // Around a pole, latitude_0 has no meaning.
    if constexpr (!std::is_same_v<Side, bool>) {
      double x = 0.0;
      map_.Forward(side_, spec.latitude_0, 0.0, x, northing_0_);
    }
  }
  [[nodiscard]] MapPoint forward(double longitude, double latitude) const override {
    MapPoint at;
    map_.Forward(side_, latitude, longitude, at.easting, at.northing);
    at.northing -= northing_0_;
    return at;
  }
  [[nodiscard]] GeoPoint inverse(double x, double y) const override {
    GeoPoint at;
    map_.Reverse(side_, x, y + northing_0_, at.latitude, at.longitude);
    return at;
  }
  [[nodiscard]] MapScale scale(double longitude, double latitude) const override {
    double x = 0.0;
    double y = 0.0;
    double gamma = 0.0;
    double k = 1.0;
    map_.Forward(side_, latitude, longitude, x, y, gamma, k);
    return {k, k};
  }

 private:
  Library map_;
  Side side_;
  double northing_0_ = 0.0;
};

/// A reference system, whose map somebody else has understood.
class Projection::Map::System final : public Map {
 public:
  explicit System(const ProjectionSpec& map_spec) : Map(map_spec) {
    if (!spec.map) {
      throw Error(ErrorCode::kUnsupported, fmt::format("the map {} is not understood yet; see understand_world()",
                                                       spec.system.name.empty() ? spec.system.text : spec.system.name));
    }
  }
  [[nodiscard]] MapPoint forward(double longitude, double latitude) const override {
    return spec.map->map_from_geo({longitude, latitude});
  }
  [[nodiscard]] GeoPoint inverse(double x, double y) const override { return spec.map->geo_from_map({x, y}); }
  [[nodiscard]] MapScale scale(double longitude, double latitude) const override {
    const PlaceScale at = scale_at(*spec.map, forward(longitude, latitude));
    return {at.least, at.most};
  }
};

std::shared_ptr<const Projection::Map> Projection::Map::make(const ProjectionSpec& spec) {
  const double radius_m = spec.ellipsoid.semi_major_axis_m;
  const double flattening = spec.ellipsoid.flattening();
  const auto conformal = [&spec]<typename Library, typename Side>(const Library& map, Side side) {
    return std::make_shared<Conformal<Library, Side>>(spec, map, side);
  };
  switch (spec.kind) {
    case ProjectionKind::kEquirectangular:
      return std::make_shared<Equirectangular>(spec);
    case ProjectionKind::kLocal:
      return std::make_shared<Local>(spec);
    case ProjectionKind::kTransverseMercator:
    case ProjectionKind::kUtm:
      return conformal(GeographicLib::TransverseMercator(radius_m, flattening, spec.scale_0), 0.0);
    case ProjectionKind::kLambertConformal:
      return conformal(
          GeographicLib::LambertConformalConic(radius_m, flattening, spec.parallel_1, spec.parallel_2, 1.0), 0.0);
    case ProjectionKind::kPolarStereographic: {
      GeographicLib::PolarStereographic map(radius_m, flattening, 1.0);
      map.SetScale(std::abs(spec.parallel_1), 1.0);
      return conformal(map, spec.parallel_1 > 0.0);
    }
    case ProjectionKind::kSystem:
      return std::make_shared<System>(spec);
    case ProjectionKind::kNone:
      break;
  }
  throw Error(ErrorCode::kInvalidArgument, "projection none makes no map");
}

Projection::Projection(const ProjectionSpec& spec) {
  try {
    map_ = Map::make(spec);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {
    throw Error(ErrorCode::kInvalidArgument, fmt::format("projection {}: {}", to_string(spec.kind), error.what()));
  }
}

const ProjectionSpec& Projection::spec() const {
  return map_->spec;
}

MapPoint Projection::forward(GeoPoint place) const {
  if (!(std::abs(place.latitude) <= 90.0) || !std::isfinite(place.longitude)) return {kNowhere, kNowhere};
  const MapPoint at = map_->forward(normalised(place.longitude - map_->spec.longitude_0), place.latitude);
  return {at.easting + map_->spec.false_easting, at.northing + map_->spec.false_northing};
}

GeoPoint Projection::inverse(MapPoint place) const {
  const GeoPoint at =
      map_->inverse(place.easting - map_->spec.false_easting, place.northing - map_->spec.false_northing);
  return {normalised(at.longitude + map_->spec.longitude_0), at.latitude};
}

MapScale Projection::scale(GeoPoint place) const {
  return map_->scale(normalised(place.longitude - map_->spec.longitude_0), place.latitude);
}

DegreeLengths degree_lengths(const Ellipsoid& ellipsoid, double latitude) {
  const GeographicLib::Ellipsoid body(ellipsoid.semi_major_axis_m, ellipsoid.flattening());
  return {body.CircleRadius(latitude) * kDegree, body.MeridionalCurvatureRadius(latitude) * kDegree};
}

}  // namespace isohf
