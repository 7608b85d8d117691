#pragma once

#include <memory>

#include "isohf/projection.h"

namespace isohf {

/// The least and the largest scale at a place, over all directions: length on the map for length on the ground.
struct MapScale {
  double least = 1.0;
  double most = 1.0;

  /// The larger of the two's deviations from 1.
  [[nodiscard]] double error() const;
};

/// A map projection of a body, computed with GeographicLib to nanometres. Immutable, cheap to copy, thread-safe.
class Projection {
 public:
  /// Any kind but none. Throws Error{kInvalidArgument} where the parameters make no map.
  explicit Projection(const ProjectionSpec& spec);

  [[nodiscard]] const ProjectionSpec& spec() const;

  /// Longitudes are taken modulo 360, nearest to longitude_0. NaN where the map has no place for it.
  [[nodiscard]] MapPoint forward(GeoPoint place) const;
  /// longitude in [-180, 180]. NaN where the map shows no place.
  [[nodiscard]] GeoPoint inverse(MapPoint place) const;
  [[nodiscard]] MapScale scale(GeoPoint place) const;

 private:
  class Map;
  std::shared_ptr<const Map> map_;
};

/// Length of a degree, metres: along the parallel and along the meridian.
struct DegreeLengths {
  double along_parallel;
  double along_meridian;
};
[[nodiscard]] DegreeLengths degree_lengths(const Ellipsoid& ellipsoid, double latitude);

}  // namespace isohf
