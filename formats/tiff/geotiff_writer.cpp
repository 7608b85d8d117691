#include "formats/tiff/geotiff_writer.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace isohf {
namespace {

// Key numbers and codes: OGC GeoTIFF 1.1 (19-008r4), annex B and clause 7.
constexpr std::uint16_t kModelType = 1024;
constexpr std::uint16_t kRasterType = 1025;
constexpr std::uint16_t kCitation = 1026;
constexpr std::uint16_t kGeodeticCrs = 2048;
constexpr std::uint16_t kGeodeticCitation = 2049;
constexpr std::uint16_t kAngularUnits = 2054;
constexpr std::uint16_t kSemiMajorAxis = 2057;
constexpr std::uint16_t kSemiMinorAxis = 2058;
constexpr std::uint16_t kInverseFlattening = 2059;
constexpr std::uint16_t kProjectedCrs = 3072;
constexpr std::uint16_t kProjectedCitation = 3073;
constexpr std::uint16_t kLinearUnits = 3076;
constexpr std::uint16_t kLinearUnitSize = 3077;
constexpr std::uint16_t kDatum = 2050;
constexpr std::uint16_t kEllipsoid = 2056;
constexpr std::uint16_t kProjection = 3074;
constexpr std::uint16_t kMethod = 3075;
constexpr std::uint16_t kParallel1 = 3078;
constexpr std::uint16_t kParallel2 = 3079;
constexpr std::uint16_t kNaturalLongitude = 3080;
constexpr std::uint16_t kNaturalLatitude = 3081;
constexpr std::uint16_t kFalseEasting = 3082;
constexpr std::uint16_t kFalseNorthing = 3083;
constexpr std::uint16_t kFalseOriginLongitude = 3084;
constexpr std::uint16_t kFalseOriginLatitude = 3085;
constexpr std::uint16_t kFalseOriginEasting = 3086;
constexpr std::uint16_t kFalseOriginNorthing = 3087;
constexpr std::uint16_t kCentreLongitude = 3088;
constexpr std::uint16_t kCentreLatitude = 3089;
constexpr std::uint16_t kNaturalScale = 3092;
constexpr std::uint16_t kVerticalLongitude = 3095;
constexpr std::uint16_t kVerticalCrs = 4096;
constexpr std::uint16_t kVerticalCitation = 4097;
constexpr std::uint16_t kVerticalUnits = 4099;

constexpr std::uint16_t kUserDefined = 32767;
constexpr std::uint16_t kDoublesTag = 34736;
constexpr std::uint16_t kAsciiTag = 34737;
constexpr std::uint16_t kDegree = 9102;
constexpr std::size_t kMaxText = 60000;  // counts and offsets are 16 bits

/// Collects keys and lays out their three tags.
class KeyWriter {
 public:
  explicit KeyWriter(GeoTags& tags) : tags_(tags) {}

  void number(std::uint16_t key, std::uint16_t value) { keys_[key] = {0, 1, value}; }

  void real(std::uint16_t key, double value) {
    keys_[key] = {kDoublesTag, 1, static_cast<std::uint16_t>(tags_.doubles.size())};
    tags_.doubles.push_back(value);
  }

  /// A bar ends each text, so that none may contain one.
  void text(std::uint16_t key, std::string value) {
    if (value.empty() || tags_.ascii.size() + value.size() > kMaxText) return;
    std::replace(value.begin(), value.end(), '|', '/');
    keys_[key] = {kAsciiTag, static_cast<std::uint16_t>(value.size() + 1),
                  static_cast<std::uint16_t>(tags_.ascii.size())};
    tags_.ascii += value + '|';
  }

  /// The directory: version 1.1.0, the count, then the keys in order.
  void finish() {
    tags_.directory = {1, 1, 0, static_cast<std::uint16_t>(keys_.size())};
    for (const auto& [key, entry] : keys_) {
      tags_.directory.insert(tags_.directory.end(), {key, entry.location, entry.count, entry.value});
    }
  }

 private:
  struct Entry {
    std::uint16_t location;
    std::uint16_t count;
    std::uint16_t value;
  };
  GeoTags& tags_;
  std::map<std::uint16_t, Entry> keys_;
};

/// EPSG codes of the units of length that have one.
std::optional<std::uint16_t> linear_unit_code(double metres) {
  if (metres == 1.0) return std::uint16_t{9001};
  if (metres == 0.3048) return std::uint16_t{9002};
  if (metres == 1200.0 / 3937.0) return std::uint16_t{9003};  // US survey foot
  if (metres == 1000.0) return std::uint16_t{9036};
  return std::nullopt;
}

std::uint16_t code_or_user_defined(const std::optional<int>& epsg) {
  return epsg && *epsg > 0 && *epsg < kUserDefined ? static_cast<std::uint16_t>(*epsg) : kUserDefined;
}

void write_system(const Georeference& geo, KeyWriter& keys) {
  const ReferenceSystem& system = geo.system;
  const bool projected = geo.unit == HorizontalUnit::kMetre;
  constexpr std::uint16_t kProjected = 1;
  constexpr std::uint16_t kGeographic = 2;
  keys.number(kModelType, projected ? kProjected : kGeographic);
  keys.number(projected ? kProjectedCrs : kGeodeticCrs, code_or_user_defined(system.epsg));
  if (!projected) {
    keys.number(kAngularUnits, kDegree);
  } else if (const auto code = linear_unit_code(geo.metres_per_unit)) {
    keys.number(kLinearUnits, *code);
  } else {
    keys.number(kLinearUnits, kUserDefined);
    keys.real(kLinearUnitSize, geo.metres_per_unit);
  }
  keys.text(kCitation, system.name);
  if (!system.wkt.empty()) {
    keys.text(projected ? kProjectedCitation : kGeodeticCitation, "ESRI PE String = " + system.wkt);
  } else if (!projected) {
    keys.text(kGeodeticCitation, system.name);
  }
  if (!system.semi_major_axis_m) return;
  if (projected && !system.epsg) keys.number(kGeodeticCrs, kUserDefined);
  keys.real(kSemiMajorAxis, *system.semi_major_axis_m);
  if (!system.inverse_flattening) return;
  if (*system.inverse_flattening == 0.0) {  // a sphere has no inverse flattening
    keys.real(kSemiMinorAxis, *system.semi_major_axis_m);
  } else {
    keys.real(kInverseFlattening, *system.inverse_flattening);
  }
}

/// Methods and parameters: GeoTIFF 1.0, sections 6.3.3.3 and 2.7, as readers of it know them.
void write_projection(const ProjectionSpec& spec, KeyWriter& keys) {
  constexpr std::uint16_t kTransverseMercator = 1;
  constexpr std::uint16_t kMercator = 7;
  constexpr std::uint16_t kLambertConformalTwoParallels = 8;
  constexpr std::uint16_t kAzimuthalEquidistant = 12;
  constexpr std::uint16_t kPolarStereographic = 15;
  keys.number(kProjectedCrs, kUserDefined);
  keys.number(kProjection, kUserDefined);
  keys.number(kAngularUnits, kDegree);
  const bool is_wgs84 = spec.ellipsoid == Ellipsoid{};
  constexpr std::uint16_t kWgs84 = 4326;
  keys.number(kGeodeticCrs, is_wgs84 ? kWgs84 : kUserDefined);
  if (!is_wgs84) {
    keys.number(kDatum, kUserDefined);
    keys.number(kEllipsoid, kUserDefined);
  }
  switch (spec.kind) {
    case ProjectionKind::kTransverseMercator:
    case ProjectionKind::kUtm:
      keys.number(kMethod, kTransverseMercator);
      keys.real(kNaturalLatitude, spec.latitude_0);
      keys.real(kNaturalLongitude, spec.longitude_0);
      keys.real(kNaturalScale, spec.scale_0);
      break;
    case ProjectionKind::kLambertConformal:
      keys.real(kParallel1, spec.parallel_1 == -spec.parallel_2 ? std::abs(spec.parallel_1) : spec.parallel_1);
      if (spec.parallel_1 == -spec.parallel_2) {
        keys.number(kMethod, kMercator);
        keys.real(kNaturalLongitude, spec.longitude_0);
        break;
      }
      keys.number(kMethod, kLambertConformalTwoParallels);
      keys.real(kParallel2, spec.parallel_2);
      keys.real(kFalseOriginLatitude, spec.latitude_0);
      keys.real(kFalseOriginLongitude, spec.longitude_0);
      keys.real(kFalseOriginEasting, spec.false_easting);
      keys.real(kFalseOriginNorthing, spec.false_northing);
      return;
    case ProjectionKind::kPolarStereographic:
      keys.number(kMethod, kPolarStereographic);
      keys.real(kNaturalLatitude, spec.parallel_1);
      keys.real(kVerticalLongitude, spec.longitude_0);
      keys.real(kNaturalScale, 1.0);
      break;
    case ProjectionKind::kLocal:
      keys.number(kMethod, kAzimuthalEquidistant);
      keys.real(kCentreLatitude, spec.latitude_0);
      keys.real(kCentreLongitude, spec.longitude_0);
      break;
    case ProjectionKind::kEquirectangular:
    case ProjectionKind::kNone:
      return;
  }
  keys.real(kFalseEasting, spec.false_easting);
  keys.real(kFalseNorthing, spec.false_northing);
}

void write_vertical(const ReferenceSystem& system, double metres_per_unit, const std::string& unit, KeyWriter& keys) {
  if (system.vertical_epsg) keys.number(kVerticalCrs, code_or_user_defined(system.vertical_epsg));
  keys.text(kVerticalCitation, system.vertical_datum);
  if (unit.empty()) return;
  if (const auto code = linear_unit_code(metres_per_unit)) keys.number(kVerticalUnits, *code);
}

}  // namespace

GeoTags geotiff_tags(const Georeference& georeference, const std::optional<ProjectionSpec>& projection,
                     double metres_per_vertical_unit, const std::string& vertical_unit) {
  GeoTags tags;
  const bool has_unit = georeference.unit != HorizontalUnit::kUnknown;
  const bool has_spacing = georeference.spacing_x != 1.0 || georeference.spacing_y != 1.0;
  const bool is_area = georeference.registration == Registration::kArea;
  if (!has_unit && !has_spacing && !georeference.has_origin && !is_area) return tags;
  if (has_spacing || georeference.has_origin) tags.pixel_scale = {georeference.spacing_x, georeference.spacing_y, 0.0};
  if (georeference.has_origin) {
    const double to_corner = georeference.registration == Registration::kPoint ? 0.0 : 0.5;
    tags.tiepoints = {0.0,
                      0.0,
                      0.0,
                      georeference.origin_x - to_corner * georeference.spacing_x,
                      georeference.origin_y + to_corner * georeference.spacing_y,
                      0.0};
  }
  KeyWriter keys(tags);
  constexpr std::uint16_t kArea = 1;
  constexpr std::uint16_t kPoint = 2;
  keys.number(kRasterType, georeference.registration == Registration::kPoint ? kPoint : kArea);
  if (has_unit && projection) {
    Georeference on_map = georeference;
    on_map.system.wkt.clear();
    write_system(on_map, keys);
    write_projection(*projection, keys);
    keys.text(kProjectedCitation, georeference.system.name);
  } else if (has_unit) {
    write_system(georeference, keys);
  }
  write_vertical(georeference.system, metres_per_vertical_unit, vertical_unit, keys);
  keys.finish();
  return tags;
}

}  // namespace isohf
