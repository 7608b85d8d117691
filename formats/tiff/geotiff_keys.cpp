#include "formats/tiff/geotiff_keys.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "formats/georeference/reference_system.h"
#include "formats/georeference/units.h"
#include "formats/georeference/wkt.h"
#include "isohf/error.h"

namespace isohf {
namespace {

// Key numbers and codes: OGC GeoTIFF 1.1 (19-008r4), annex B and clause 7.
enum Key : std::uint16_t {
  kModelType = 1024,
  kRasterType = 1025,
  kCitation = 1026,
  kGeodeticCrs = 2048,
  kGeodeticCitation = 2049,
  kDatum = 2050,
  kAngularUnits = 2054,
  kAngularUnitSize = 2055,
  kEllipsoid = 2056,
  kSemiMajorAxis = 2057,
  kSemiMinorAxis = 2058,
  kInverseFlattening = 2059,
  kProjectedCrs = 3072,
  kProjectedCitation = 3073,
  kProjection = 3074,
  kMethod = 3075,
  kLinearUnits = 3076,
  kLinearUnitSize = 3077,
  kParallel1 = 3078,
  kParallel2 = 3079,
  kNaturalLongitude = 3080,
  kNaturalLatitude = 3081,
  kFalseEasting = 3082,
  kFalseNorthing = 3083,
  kFalseOriginLongitude = 3084,
  kFalseOriginLatitude = 3085,
  kFalseOriginEasting = 3086,
  kFalseOriginNorthing = 3087,
  kCentreLongitude = 3088,
  kCentreLatitude = 3089,
  kNaturalScale = 3092,
  kVerticalLongitude = 3095,
  kVerticalCrs = 4096,
  kVerticalCitation = 4097,
  kVerticalUnits = 4099,
};
constexpr std::uint16_t kUserDefined = 32767;
constexpr std::uint16_t kModelProjected = 1;
constexpr std::uint16_t kModelGeographic = 2;
constexpr std::uint16_t kRasterIsArea = 1;
constexpr std::uint16_t kRasterIsPoint = 2;
constexpr std::uint16_t kDoublesTag = 34736;
constexpr std::uint16_t kAsciiTag = 34737;

/// The key directory, looked up by key; malformed entries read as absent and are counted.
class Keys {
 public:
  explicit Keys(const GeoTags& tags) : tags_(tags) {
    const auto& directory = tags.directory;
    if (directory.empty()) return;
    if (directory.size() < 4) {
      ++malformed_;
      return;
    }
    for (std::size_t i = 0; i < directory[3]; ++i) {
      const std::size_t at = 4 + 4 * i;
      if (at + 4 > directory.size()) {
        ++malformed_;
        return;
      }
      entries_[directory[at]] = {directory[at + 1], directory[at + 2], directory[at + 3]};
    }
  }

  [[nodiscard]] std::optional<int> number(Key key) {
    const Entry* entry = find(key);
    if (entry == nullptr) return std::nullopt;
    if (entry->location != 0) return absent();
    return entry->value;
  }

  /// An EPSG code; absent where undefined (0) or user-defined.
  [[nodiscard]] std::optional<int> code(Key key) {
    const std::optional<int> value = number(key);
    return value && *value != 0 && *value != kUserDefined ? value : std::nullopt;
  }

  [[nodiscard]] std::optional<double> real(Key key) {
    const Entry* entry = find(key);
    if (entry == nullptr) return std::nullopt;
    if (entry->location != kDoublesTag || entry->value >= tags_.doubles.size()) return absent();
    const double value = tags_.doubles[entry->value];
    if (!std::isfinite(value)) return absent();
    return value;
  }

  /// Text without the bars that end each string of the ASCII tag.
  [[nodiscard]] std::string text(Key key) {
    const Entry* entry = find(key);
    if (entry == nullptr) return {};
    if (entry->location != kAsciiTag || entry->value > tags_.ascii.size()) {
      ++malformed_;
      return {};
    }
    std::string value = tags_.ascii.substr(entry->value, entry->count);
    while (!value.empty() && (value.back() == '|' || value.back() == '\0' || value.back() == ' ')) value.pop_back();
    return value;
  }

  [[nodiscard]] int malformed() const { return malformed_; }

 private:
  struct Entry {
    std::uint16_t location = 0;
    std::uint16_t count = 0;
    std::uint16_t value = 0;
  };

  [[nodiscard]] const Entry* find(Key key) const {
    const auto found = entries_.find(key);
    return found == entries_.end() ? nullptr : &found->second;
  }

  std::nullopt_t absent() {
    ++malformed_;
    return std::nullopt;
  }

  const GeoTags& tags_;
  std::map<std::uint16_t, Entry> entries_;
  int malformed_ = 0;
};

/// x = x0 + dx * column, y = y0 + dy * row in raster space, where PixelIsArea puts sample (0, 0) at (0.5, 0.5).
struct AxisAligned {
  double x0 = 0.0;
  double y0 = 0.0;
  double dx = 0.0;
  double dy = 0.0;
  bool has_origin = false;
};

void require_usable(const AxisAligned& map) {
  const bool finite = std::isfinite(map.dx) && std::isfinite(map.dy) && std::isfinite(map.x0) && std::isfinite(map.y0);
  if (!finite || map.dx == 0.0 || map.dy == 0.0) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("the georeference has spacing {} x {}, must be finite and not 0", map.dx, map.dy));
  }
  if (map.dx < 0.0) {
    throw Error(ErrorCode::kUnsupported,
                "the georeference runs the columns from East to West; isohf reads rasters whose "
                "columns run from West to East (gdalwarp turns it)");
  }
}

AxisAligned map_from_transformation(const std::vector<double>& m) {
  if (m.size() < 16) {
    throw Error(ErrorCode::kCorrupt, fmt::format("ModelTransformationTag has {} values, must have 16", m.size()));
  }
  // A millionth of a sample across the largest raster is the most that a rounded zero may turn it.
  const double across = 1e-9 * std::max(std::abs(m[0]), std::abs(m[5]));
  if (std::abs(m[1]) > across || std::abs(m[4]) > across) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("the georeference is rotated or sheared (ModelTransformationTag {}, {}, {}, {}); isohf reads "
                    "north-up rasters (gdalwarp makes one)",
                    m[0], m[1], m[4], m[5]));
  }
  return {m[3], m[7], m[0], m[5], true};
}

std::optional<AxisAligned> map_from_tags(const GeoTags& tags, std::vector<Warning>& warnings) {
  const auto& scale = tags.pixel_scale;
  const auto& tie = tags.tiepoints;
  if (scale.size() >= 2) {
    // Files with a negative scale are as a rule north-up ones whose writer erred; GDAL reads them so as well.
    if (scale[1] < 0.0) warnings.push_back("ModelPixelScaleTag has a negative y; its sign is ignored");
    AxisAligned map{0.0, 0.0, scale[0], -std::abs(scale[1]), false};
    if (tie.size() >= 6) {
      map.x0 = tie[3] - tie[0] * map.dx;
      map.y0 = tie[4] - tie[1] * map.dy;
      map.has_origin = true;
    } else {
      warnings.push_back(loss("the georeference has a pixel scale but no tie point: the position is unknown"));
    }
    return map;
  }
  if (!tags.transformation.empty()) return map_from_transformation(tags.transformation);
  if (!tie.empty()) {
    warnings.push_back(
        loss("the georeference has tie points only (ground control points), which are not used: spacing and "
             "position are unknown"));
  }
  return std::nullopt;
}

/// Degrees in one angular unit of the EPSG dataset.
std::optional<double> degrees_per_unit(int epsg) {
  switch (epsg) {
    case 9102:
    case 9122:
      return 1.0;
    case 9101:
      return 180.0 / std::numbers::pi;
    case 9103:
      return 1.0 / 60.0;
    case 9104:
      return 1.0 / 3600.0;
    case 9105:
    case 9106:
      return 0.9;
    default:
      return std::nullopt;
  }
}

struct KnownEllipsoid {
  int code;
  double semi_major_axis_m;
  double inverse_flattening;
};

// EPSG dataset: ellipsoids that files name by code alone.
constexpr std::array<KnownEllipsoid, 6> kEllipsoids = {{
    {7030, 6378137.0, 298.257223563},     // WGS 84
    {7019, 6378137.0, 298.257222101},     // GRS 1980
    {7022, 6378388.0, 297.0},             // International 1924
    {7004, 6377397.155, 299.1528128},     // Bessel 1841
    {7008, 6378206.4, 294.978698213898},  // Clarke 1866
    {7043, 6378135.0, 298.26},            // WGS 72
}};

std::optional<int> ellipsoid_of_crs(int epsg) {
  if (epsg == 4326 || epsg == 3857 || (epsg > 32600 && epsg <= 32660) || (epsg > 32700 && epsg <= 32760)) return 7030;
  if (epsg == 4258 || epsg == 4269 || epsg == 3035 || (epsg >= 25828 && epsg <= 25838)) return 7019;
  if (epsg == 4322) return 7043;
  if (epsg == 4267) return 7008;
  return std::nullopt;
}

void read_ellipsoid(Keys& keys, ReferenceSystem& system) {
  system.semi_major_axis_m = keys.real(kSemiMajorAxis);
  system.inverse_flattening = keys.real(kInverseFlattening);
  if (const auto minor = keys.real(kSemiMinorAxis); minor && system.semi_major_axis_m && !system.inverse_flattening) {
    const double major = *system.semi_major_axis_m;
    system.inverse_flattening = major == *minor ? 0.0 : major / (major - *minor);
  }
  if (system.semi_major_axis_m && *system.semi_major_axis_m > 0.0) return;
  system.semi_major_axis_m.reset();
  std::optional<int> code = keys.code(kEllipsoid);
  if (!code && system.epsg) code = ellipsoid_of_crs(*system.epsg);
  if (!code && keys.code(kGeodeticCrs)) code = ellipsoid_of_crs(*keys.code(kGeodeticCrs));
  for (const KnownEllipsoid& known : kEllipsoids) {
    if (code != known.code) continue;
    system.semi_major_axis_m = known.semi_major_axis_m;
    system.inverse_flattening = known.inverse_flattening;
  }
}

constexpr std::string_view kEsri = "ESRI PE String = ";

/// The WKT in one of the citations, as ArcGIS writes it; empty where none has any.
std::string esri_wkt(Keys& keys) {
  for (const Key key : {kProjectedCitation, kCitation, kGeodeticCitation}) {
    if (const std::string text = keys.text(key); text.starts_with(kEsri)) return text.substr(kEsri.size());
  }
  return {};
}

/// "GCS Name = A|Datum = B" is A; an ESRI string is its first quoted name, and the whole of it the WKT.
void read_name(Keys& keys, bool projected, ReferenceSystem& system) {
  std::string name = projected ? keys.text(kProjectedCitation) : keys.text(kGeodeticCitation);
  if (name.empty()) name = keys.text(kCitation);
  if (name.empty()) name = keys.text(kGeodeticCitation);
  if (name.rfind(kEsri, 0) == 0) {
    system.wkt = name.substr(kEsri.size());
    const std::size_t open = system.wkt.find('"');
    const std::size_t close = open == std::string::npos ? open : system.wkt.find('"', open + 1);
    name = close == std::string::npos ? std::string() : system.wkt.substr(open + 1, close - open - 1);
  } else {
    name = name.substr(0, name.find('|'));
    if (const std::size_t equals = name.find(" Name = "); equals != std::string::npos) name = name.substr(equals + 8);
  }
  system.name = name;
}

/// The unit of a map whose file has no key for it: that of its WKT or of its code.
void assume_unit(const std::string& wkt, GeoTiffPlace& place) {
  Georeference& geo = place.georeference;
  Georeference told;
  if (!wkt.empty() && read_wkt(wkt, told) && told.unit == HorizontalUnit::kMetre) {
    geo.metres_per_unit = told.metres_per_unit;
    return;
  }
  // These are in metres, and in nearly every file.
  if (!geo.system.epsg || ellipsoid_of_crs(*geo.system.epsg)) return;
  try {
    const auto system = understand_system(system_text(geo.system));
    if (system->description().is_projected) geo.metres_per_unit = system->description().unit;
  } catch (const Error& error) {
    place.warnings.push_back(fmt::format(
        "the file does not say its unit, and that of its code is not known: metres are taken; {}", error.what()));
  }
}

void read_horizontal_unit(Keys& keys, bool projected, GeoTiffPlace& place, double& degrees) {
  Georeference& geo = place.georeference;
  degrees = 1.0;
  if (projected) {
    geo.unit = HorizontalUnit::kMetre;
    const std::optional<int> code = keys.code(kLinearUnits);
    const std::optional<double> size = keys.real(kLinearUnitSize);
    if (!size && !code) {
      assume_unit(esri_wkt(keys), place);
    } else if (size && *size > 0.0) {
      geo.metres_per_unit = *size;
    } else if (const auto unit = code ? linear_unit(*code) : std::nullopt) {
      geo.metres_per_unit = unit->metres;
    } else {
      geo.unit = HorizontalUnit::kUnknown;
      place.warnings.push_back(loss(fmt::format("linear unit {} is not known: the spacing has no unit", *code)));
    }
    return;
  }
  geo.unit = HorizontalUnit::kDegree;
  const std::optional<int> code = keys.code(kAngularUnits);
  const std::optional<double> radians = keys.real(kAngularUnitSize);
  if (const auto known = code ? degrees_per_unit(*code) : 1.0; known && !(radians && !code)) {
    degrees = *known;
  } else if (radians && *radians > 0.0) {
    degrees = *radians * 180.0 / std::numbers::pi;
  } else {
    geo.unit = HorizontalUnit::kUnknown;
    place.warnings.push_back(
        loss(fmt::format("angular unit {} is not known: the spacing has no unit", code.value_or(0))));
  }
}

constexpr std::array<std::pair<int, const char*>, 5> kVerticalDatums = {
    {{5773, "EGM96"}, {3855, "EGM2008"}, {5798, "EGM84"}, {5703, "NAVD88"}, {5714, "mean sea level"}}};

void read_vertical(Keys& keys, GeoTiffPlace& place) {
  ReferenceSystem& system = place.georeference.system;
  system.vertical_epsg = keys.code(kVerticalCrs);
  system.vertical_datum = keys.text(kVerticalCitation);
  if (system.vertical_datum.empty() && system.vertical_epsg) {
    for (const auto& [code, name] : kVerticalDatums) {
      if (system.vertical_epsg == code) system.vertical_datum = name;
    }
  }
  if (const std::optional<int> code = keys.code(kVerticalUnits)) {
    if (const auto unit = linear_unit(*code)) {
      place.vertical_unit = unit->name;
      place.metres_per_vertical_unit = unit->metres;
    } else {
      place.warnings.push_back(loss(fmt::format("vertical unit {} is not known", *code)));
    }
  }
}

void read_system(Keys& keys, GeoTiffPlace& place, double& degrees) {
  ReferenceSystem& system = place.georeference.system;
  std::optional<int> model = keys.number(kModelType);
  if (model == kUserDefined || model == 0) model.reset();  // what ESRI's strings come with: the other keys tell
  const std::optional<int> projected_crs = keys.number(kProjectedCrs);
  const std::string esri = esri_wkt(keys);
  if (Georeference told; !model && !projected_crs && !esri.empty() && read_wkt(esri, told)) {
    place.georeference.unit = told.unit;
    place.georeference.metres_per_unit = told.metres_per_unit;
    system = told.system;
    read_vertical(keys, place);
    return;
  }
  const bool projected = model ? *model == kModelProjected : projected_crs.has_value();
  const bool geographic = !projected && (model ? *model == kModelGeographic : keys.number(kGeodeticCrs).has_value());
  degrees = 1.0;
  if (projected) system.epsg = keys.code(kProjectedCrs);
  if (geographic) system.epsg = keys.code(kGeodeticCrs);
  if (projected || geographic) read_horizontal_unit(keys, projected, place, degrees);
  read_name(keys, projected, system);
  read_ellipsoid(keys, system);
  const std::string citations = system.name + ' ' + keys.text(kCitation) + ' ' + keys.text(kGeodeticCitation) + ' ' +
                                keys.text(kProjectedCitation);
  // An EPSG code without anything else names a place on the Earth.
  system.body = body_of(citations, system.semi_major_axis_m);
  if (system.body.empty() && system.epsg) system.body = "Earth";
  read_vertical(keys, place);
}

constexpr std::uint16_t kDegree = 9102;
constexpr std::size_t kMaxText = 60000;  // counts and offsets are 16 bits

/// Collects keys and lays out their three tags.
class KeyWriter {
 public:
  explicit KeyWriter(GeoTags& tags) : tags_(tags) {}

  void number(Key key, std::uint16_t value) { keys_[key] = {0, 1, value}; }

  void real(Key key, double value) {
    keys_[key] = {kDoublesTag, 1, static_cast<std::uint16_t>(tags_.doubles.size())};
    tags_.doubles.push_back(value);
  }

  /// A bar ends each text, so that none may contain one.
  void text(Key key, std::string value) {
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
  keys.number(kModelType, projected ? kModelProjected : kModelGeographic);
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

GeoTiffPlace place_from_geotiff(const GeoTags& tags, std::int64_t rows) {
  GeoTiffPlace place;
  if (tags.empty()) return place;
  Keys keys(tags);
  Georeference& geo = place.georeference;
  double degrees = 1.0;
  if (!tags.directory.empty()) read_system(keys, place, degrees);
  const int raster_type = keys.number(kRasterType).value_or(kRasterIsArea);
  const std::optional<AxisAligned> map = map_from_tags(tags, place.warnings);
  if (map || !tags.directory.empty()) {
    geo.registration = raster_type == kRasterIsPoint ? Registration::kPoint : Registration::kArea;
  }
  if (map) {
    require_usable(*map);
    place.placed = true;
    const double to_sample = geo.registration == Registration::kPoint ? 0.0 : 0.5;
    place.rows_from_south = map->dy > 0.0;
    const double first_row = place.rows_from_south ? static_cast<double>(rows - 1) : 0.0;
    geo.spacing_x = map->dx * degrees;
    geo.spacing_y = std::abs(map->dy) * degrees;
    geo.has_origin = map->has_origin;
    if (geo.has_origin) {
      geo.origin_x = (map->x0 + to_sample * map->dx) * degrees;
      geo.origin_y = (map->y0 + (first_row + to_sample) * map->dy) * degrees;
    }
  }
  if (keys.malformed() > 0) {
    place.warnings.push_back(loss(fmt::format("{} GeoTIFF keys are malformed and are ignored", keys.malformed())));
  }
  return place;
}

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
  keys.number(kRasterType, georeference.registration == Registration::kPoint ? kRasterIsPoint : kRasterIsArea);
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
