// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace isohf {

class ReferenceMap;

/// A place on a body: degrees, East and North positive. Latitudes are those of the ellipsoid's normal.
struct GeoPoint {
  double longitude = 0.0;
  double latitude = 0.0;
};

/// A place on the map, metres: East and North positive.
struct MapPoint {
  double easting = 0.0;
  double northing = 0.0;
};

/// A rectangle of longitudes and latitudes, degrees; east >= west, and above 180 where it crosses the antimeridian.
struct GeoExtent {
  double west = 0.0;
  double south = 0.0;
  double east = 0.0;
  double north = 0.0;

  [[nodiscard]] GeoPoint middle() const { return {(west + east) / 2.0, (south + north) / 2.0}; }
};

/// Size and shape of a body; WGS 84 by default.
struct Ellipsoid {
  double semi_major_axis_m = 6378137.0;
  double inverse_flattening = 298.257223563;  ///< 0 for a sphere

  [[nodiscard]] double flattening() const { return inverse_flattening > 0.0 ? 1.0 / inverse_flattening : 0.0; }
  friend bool operator==(const Ellipsoid&, const Ellipsoid&) = default;
};

/// How degrees become metres.
enum class ProjectionKind {
  kNone,                ///< not at all: one world unit is one unit of the source
  kEquirectangular,     ///< both axes scaled at latitude_0
  kLocal,               ///< azimuthal equidistant around (longitude_0, latitude_0)
  kTransverseMercator,  ///< conformal along the meridian longitude_0
  kUtm,                 ///< the same with the parameters of zone utm_zone
  kLambertConformal,    ///< conformal between two parallels; a Mercator map where they lie opposite each other
  kPolarStereographic,  ///< conformal around the pole on the side of parallel_1, true to scale there
  kSystem,              ///< a reference system, by PROJ
};

/// "none", "equirectangular", "local", "transverse-mercator", "utm", "lambert-conformal", "polar-stereographic",
/// "system".
[[nodiscard]] std::string to_string(ProjectionKind kind);
/// The inverse; throws Error{kInvalidArgument} naming all of them for any other text.
[[nodiscard]] ProjectionKind projection_kind_from_string(const std::string& text);

/// A projected reference system as a map of ground whose longitudes and latitudes are on another datum, as they may be.
struct MappedSystem {
  std::string text;  ///< "EPSG:3035", or WKT
  std::string name;  ///< "ETRS89-extended / LAEA Europe"
  std::string
      operation;  ///< PROJ's pipeline: degrees on the ground's datum -> easting and northing, units of the system
  double metres_per_unit = 1.0;

  friend bool operator==(const MappedSystem&, const MappedSystem&) = default;
};

/// A map projection with all its parameters. What a kind does not use is 0; scale_0 then is 1.
struct ProjectionSpec {
  ProjectionKind kind = ProjectionKind::kNone;
  Ellipsoid ellipsoid;
  double longitude_0 = 0.0;  ///< degrees
  double latitude_0 = 0.0;   ///< northing is 0 there (but for UTM and polar-stereographic maps)
  double parallel_1 = 0.0;   ///< lambert-conformal, polar-stereographic: true to scale
  double parallel_2 = 0.0;   ///< lambert-conformal
  double scale_0 = 1.0;      ///< transverse-mercator: scale along longitude_0
  double false_easting = 0.0;
  double false_northing = 0.0;
  int utm_zone = 0;     ///< 1...60, negative in the South
  MappedSystem system;  ///< of kind system, which uses nothing else but the ellipsoid
  /// The map of kind system, metres, once its operation is understood; never stored.
  std::shared_ptr<const ReferenceMap> map;

  friend bool operator==(const ProjectionSpec& a, const ProjectionSpec& b) {
    return a.kind == b.kind && a.ellipsoid == b.ellipsoid && a.longitude_0 == b.longitude_0 &&
           a.latitude_0 == b.latitude_0 && a.parallel_1 == b.parallel_1 && a.parallel_2 == b.parallel_2 &&
           a.scale_0 == b.scale_0 && a.false_easting == b.false_easting && a.false_northing == b.false_northing &&
           a.utm_zone == b.utm_zone && a.system == b.system;
  }
};

/// What a user asks for: a kind, or that one be chosen, and parameters (docs/cli.md).
struct ProjectionRequest {
  bool is_auto = true;
  ProjectionKind kind = ProjectionKind::kNone;
  std::vector<double> parameters;  ///< as written behind the kind; empty: from the extent
  int utm_zone = 0;                ///< 0: from the extent
  bool is_given = false;           ///< by the user: an input on a map of its own leaves it for nothing else
  std::string system;              ///< of kind system, as the user has it
  ProjectionSpec system_map;       ///< the same, once it is understood for the input: understand_ground()
  std::string system_body;         ///< the input's, if the system is a projection that was moved there from the Earth
  std::string system_note;         ///< what a user must hear of the way there, one line; mostly empty

  /// "auto", "KIND", "KIND:PARAMETERS" or a reference system: local:LON,LAT  transverse-mercator:LON[,SCALE]  utm:32N
  /// lambert-conformal:LAT1,LAT2[,LON]  polar-stereographic:LAT[,LON]  EPSG:3035  WKT  a PROJ string. Throws
  /// Error{kInvalidArgument}, "found ..., must be ...".
  [[nodiscard]] static ProjectionRequest parse(const std::string& text);
  /// What the user wrote of it: the system, else the kind, or "auto".
  [[nodiscard]] std::string name() const;
};

/// A horizontal reference system that is understood: its coordinates <-> places on the body. Longitudes and latitudes
/// are those of the system's own datum, counted from Greenwich. Immutable and thread-safe.
class ReferenceMap {
 public:
  ReferenceMap() = default;
  ReferenceMap(const ReferenceMap&) = delete;
  ReferenceMap& operator=(const ReferenceMap&) = delete;
  virtual ~ReferenceMap() = default;

  /// longitude in [-180, 180]. NaN where the map shows no place. Coordinates are in units of metres_per_unit().
  [[nodiscard]] virtual GeoPoint geo_from_map(MapPoint place) const = 0;
  /// NaN where the map has no place for it.
  [[nodiscard]] virtual MapPoint map_from_geo(GeoPoint place) const = 0;
  [[nodiscard]] virtual double metres_per_unit() const = 0;
  [[nodiscard]] virtual const Ellipsoid& ellipsoid() const = 0;
};

/// What lies under a rectangle of a map.
struct MapGround {
  GeoPoint centre;          ///< under the rectangle's
  GeoExtent extent;         ///< the least one that holds the ground; all longitudes where a pole is inside
  double mean_scale = 1.0;  ///< of places evenly spread over the map: of lengths, over all directions
  double least_scale = 1.0;
  double most_scale = 1.0;
  double worst_error = 0.0;  ///< the largest deviation of a scale from 1
  GeoPoint worst_place;

  /// Beyond this lengths of the map are no lengths of the ground (docs/decisions/0029).
  static constexpr double kTrueEnough = 0.02;
};

}  // namespace isohf
