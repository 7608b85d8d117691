#include "formats/geotiff/geotiff_keys.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "formats/georeference/map_wkt.h"
#include "formats/georeference/wkt.h"
#include "formats/io/text.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs.h"
#include "isohf/projection/length_unit.h"
#include "isohf/projection/source_system.h"

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
  kPrimeMeridian = 2051,
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
  kCentreEasting = 3090,
  kCentreNorthing = 3091,
  kCentreScale = 3093,
  kAzimuth = 3094,
  kVerticalLongitude = 3095,
  kGridAngle = 3096,
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

/// False where PROJ does not understand the text.
bool read_wkt(const std::string& wkt, SourceInfo& info) {
  try {
    take_system(wkt, info);
    return true;
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kUnsupported) throw;
    return false;
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

/// What "GCS Name = A|Datum = B|Ellipsoid = C|Primem = D" says of `what`; empty where it says nothing.
std::string part_of_citation(const std::string& citation, const std::string& what) {
  const std::string wanted = what + " = ";
  const std::size_t at = citation.find(wanted);
  if (at == std::string::npos) return {};
  const std::size_t begin = at + wanted.size();
  return citation.substr(begin, std::min(citation.find('|', begin), citation.size()) - begin);
}

/// The name of a citation; an ESRI string is its first quoted name, and the whole of it the WKT.
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
  SourceInfo told;
  if (!wkt.empty() && read_wkt(wkt, told) && told.georeference.unit == HorizontalUnit::kMetre) {
    geo.metres_per_unit = told.georeference.metres_per_unit;
    return;
  }
  // These are in metres, and in nearly every file.
  if (!geo.system.epsg || ellipsoid_of_crs(*geo.system.epsg)) return;
  try {
    const auto system = Crs::parse(system_text(geo.system));
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
  // GeoTIFF 1.0 had codes for heights above ellipsoids, which EPSG has no systems of.
  if (system.vertical_epsg && *system.vertical_epsg >= 5001 && *system.vertical_epsg <= 5033) {
    system.vertical_epsg.reset();
    system.vertical_datum = kAboveEllipsoid;
  }
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
    return;
  }
  if (!system.vertical_epsg) return;
  const bool in_metres =
      std::ranges::any_of(kVerticalDatums, [&](const auto& known) { return known.first == system.vertical_epsg; });
  SourceInfo told;
  told.vertical_unit = in_metres ? "metre" : "";
  told.georeference.system = system;
  if (!in_metres) take_heights(*system.vertical_epsg, told);
  if (system.vertical_datum.empty()) system.vertical_datum = told.georeference.system.vertical_datum;
  place.vertical_unit = told.vertical_unit;
  place.metres_per_vertical_unit = told.metres_per_vertical_unit;
  place.warnings.insert(place.warnings.end(), told.warnings.begin(), told.warnings.end());
}

/// The geographic system beneath a map, as WKT; empty where PROJ is needed for it and not there.
std::string geographic_beneath(Keys& keys, const ReferenceSystem& system, double degrees) {
  if (const std::optional<int> code = keys.code(kGeodeticCrs)) {
    ReferenceSystem base;
    base.epsg = code;
    return wkt_of(base, WktDialect::kGdal);
  }
  if (!system.semi_major_axis_m) return {};
  const std::string citation = keys.text(kGeodeticCitation);
  const auto named = [&](const char* what, const std::string& otherwise) {
    const std::string name = part_of_citation(citation, what);
    return name.empty() ? otherwise : name;
  };
  return geographic_wkt(named("GCS Name", citation.empty() ? "unknown" : citation.substr(0, citation.find('|'))),
                        named("Datum", "unknown"), named("Ellipsoid", "unknown"), *system.semi_major_axis_m,
                        system.inverse_flattening.value_or(0.0), named("Primem", ""), degrees);
}

/// The map that keys spell out instead of naming it by a code, as WKT 1; empty, with a warning, where its method is not
/// known or its geographic system needs PROJ.
std::string map_from_keys(Keys& keys, GeoTiffPlace& place, double degrees) {
  const Georeference& geo = place.georeference;
  const int method = keys.code(kMethod).value_or(0);
  const int zone = keys.code(kProjection).value_or(0);  // 16001 to 16060 and 16101 to 16160 are the UTM zones
  if (method == 0 && zone == 0) return {};
  const bool is_utm = zone > 16000 && zone <= 16160 && zone % 100 >= 1 && zone % 100 <= 60;
  std::string_view name = method_of_code(is_utm ? 1 : method);
  const std::string geographic = geographic_beneath(keys, geo.system, degrees);
  if (name.empty() || geographic.empty()) {
    place.warnings.push_back(loss(
        name.empty() ? fmt::format("its map is of the kind {} (GeoTIFF's code), which is not known: where it lies on "
                                   "the ground is not kept",
                                   method != 0 ? method : zone)
                     : "its map lies on a geographic system that is not understood: where it lies on the ground is "
                       "not kept"));
    return {};
  }
  const auto first_of = [&](std::initializer_list<Key> names, double otherwise) {
    for (const Key key : names) {
      if (const auto value = keys.real(key)) return *value;
    }
    return otherwise;
  };
  if (name == method_of_code(7) && keys.real(kParallel1)) name = "Mercator_2SP";
  MapParameters parameters;
  parameters.latitude = first_of({kNaturalLatitude, kFalseOriginLatitude, kCentreLatitude}, 0.0);
  parameters.longitude =
      first_of({kNaturalLongitude, kFalseOriginLongitude, kCentreLongitude, kVerticalLongitude}, 0.0);
  parameters.parallel_1 = first_of({kParallel1}, 0.0);
  parameters.parallel_2 = first_of({kParallel2}, 0.0);
  parameters.scale = first_of({kNaturalScale, kCentreScale}, 1.0);
  parameters.azimuth = first_of({kAzimuth}, 0.0);
  parameters.grid_angle = first_of({kGridAngle}, parameters.azimuth);
  parameters.easting = first_of({kFalseEasting, kFalseOriginEasting, kCentreEasting}, 0.0);
  parameters.northing = first_of({kFalseNorthing, kFalseOriginNorthing, kCentreNorthing}, 0.0);
  if (is_utm) {
    parameters.longitude = 6.0 * (zone % 100) - 183.0;
    parameters.scale = 0.9996;
    parameters.easting = 500000.0 / geo.metres_per_unit;
    parameters.northing = (zone > 16100 ? 10000000.0 : 0.0) / geo.metres_per_unit;
  }
  return map_wkt(geo.system.name.empty() ? "unknown" : geo.system.name, geographic, name, parameters,
                 geo.metres_per_unit);
}

/// Longitudes that are not counted from Greenwich, which are read as if they were by nobody's wish.
void refuse_other_meridians(Keys& keys, double degrees, GeoTiffPlace& place) {
  constexpr int kGreenwich = 8901;
  std::optional<int>& code = place.georeference.system.epsg;
  // EPSG's geographic systems on other meridians: "Bern 1898 (Bern)" to "Voirol 1879 (Paris)", "ATF (Paris)" to ...
  const bool by_code = code && ((*code >= 4801 && *code <= 4821) || (*code >= 4901 && *code <= 4904));
  if (by_code || keys.number(kPrimeMeridian).value_or(kGreenwich) != kGreenwich) {
    throw Error(
        ErrorCode::kUnsupported,
        fmt::format("the reference system {} counts no degrees from Greenwich; gdalwarp brings the raster to one "
                    "that does",
                    code ? fmt::format("EPSG:{}", *code) : place.georeference.system.name));
  }
  if (degrees != 1.0) code.reset();  // its angles are degrees from now on
}

void read_system(Keys& keys, GeoTiffPlace& place, double& degrees) {
  ReferenceSystem& system = place.georeference.system;
  const std::optional<int> model = keys.code(kModelType);  // none comes with ESRI's strings: the other keys tell
  const std::optional<int> projected_crs = keys.number(kProjectedCrs);
  const std::string esri = esri_wkt(keys);
  if (SourceInfo told; !model && !projected_crs && !esri.empty() && read_wkt(esri, told)) {
    place.georeference.unit = told.georeference.unit;
    place.georeference.metres_per_unit = told.georeference.metres_per_unit;
    place.vertical_unit = told.vertical_unit;
    place.metres_per_vertical_unit = told.metres_per_vertical_unit;
    system = told.georeference.system;
    if (const std::string name = keys.text(kCitation); !name.empty() && !name.starts_with(kEsri)) system.name = name;
    if (!system.vertical_epsg && system.vertical_datum.empty()) read_vertical(keys, place);
    return;
  }
  const bool projected = model ? *model == kModelProjected : projected_crs.has_value();
  const bool geographic = !projected && (model ? *model == kModelGeographic : keys.number(kGeodeticCrs).has_value());
  degrees = 1.0;
  if (projected) system.epsg = keys.code(kProjectedCrs);
  if (geographic) system.epsg = keys.code(kGeodeticCrs);
  if (projected || geographic) read_horizontal_unit(keys, projected, place, degrees);
  read_name(keys, projected, system);
  if (!projected && !geographic && !system.name.empty()) {
    place.warnings.push_back(
        loss(fmt::format("the reference system \"{}\" is neither a map nor degrees, but a local one, or one of three "
                         "dimensions: it is left out (`reference_system` names what it is)",
                         printable(system.name))));
  }
  read_ellipsoid(keys, system);
  const std::string citations = system.name + ' ' + keys.text(kCitation) + ' ' + keys.text(kGeodeticCitation) + ' ' +
                                keys.text(kProjectedCitation);
  if (projected && !system.epsg && system.wkt.empty()) system.wkt = map_from_keys(keys, place, degrees);
  if (geographic) {
    refuse_other_meridians(keys, degrees, place);
    if (!system.epsg && system.wkt.empty()) system.wkt = geographic_beneath(keys, system, 1.0);
  }
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

  /// A bar ends each text, so that none may contain one; nor may a part of a citation of several.
  void text(Key key, std::initializer_list<std::string> parts) {
    std::string value;
    for (std::string part : parts) {
      std::replace(part.begin(), part.end(), '|', '/');
      value += (value.empty() ? "" : "|") + part;
    }
    if (value.empty() || tags_.ascii.size() + value.size() > kMaxText) return;
    keys_[key] = {kAsciiTag, static_cast<std::uint16_t>(value.size() + 1),
                  static_cast<std::uint16_t>(tags_.ascii.size())};
    tags_.ascii += value + '|';
  }
  void text(Key key, const std::string& value) { text(key, {value}); }

  /// The directory: version 1.1.0, or 1.1.1 (GeoTIFF 1.1) where codes name vertical systems, which GDAL reads in that
  /// alone; the count, then the keys in order.
  void finish() {
    const std::uint16_t minor = keys_.contains(kVerticalCrs) ? 1 : 0;
    tags_.directory = {1, 1, minor, static_cast<std::uint16_t>(keys_.size())};
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

void write_linear_unit(double metres, KeyWriter& keys) {
  if (const auto code = linear_unit_code(metres)) return keys.number(kLinearUnits, *code);
  keys.number(kLinearUnits, kUserDefined);
  keys.real(kLinearUnitSize, metres);
}

void write_ellipsoid(double semi_major_axis_m, double inverse_flattening, KeyWriter& keys) {
  keys.real(kSemiMajorAxis, semi_major_axis_m);
  if (inverse_flattening == 0.0) {  // a sphere has none
    keys.real(kSemiMinorAxis, semi_major_axis_m);
  } else {
    keys.real(kInverseFlattening, inverse_flattening);
  }
}

/// Longitudes and latitudes without a code, as GDAL writes and reads them.
void write_datum(const std::string& name, const DatumNames& names, double semi_major_axis_m, KeyWriter& keys) {
  keys.number(kAngularUnits, kDegree);
  if (names.datum.empty()) return keys.text(kGeodeticCitation, name);
  keys.text(kGeodeticCitation,
            {"GCS Name = " + name, "Datum = " + names.datum,
             "Ellipsoid = " + (names.ellipsoid.empty() ? "unknown" : names.ellipsoid),
             "Primem = " + (names.meridian.empty() ? meridian_of(semi_major_axis_m) : names.meridian)});
}

void write_keyed_map(const Georeference& geo, const KeyedMap& map, KeyWriter& keys) {
  keys.number(kModelType, kModelProjected);
  for (const Key key : {kGeodeticCrs, kDatum, kEllipsoid, kProjectedCrs, kProjection}) keys.number(key, kUserDefined);
  keys.text(kCitation, geo.system.name);
  write_datum(map.names.geographic, map.names, map.semi_major_axis_m, keys);
  write_ellipsoid(map.semi_major_axis_m, map.inverse_flattening, keys);
  write_linear_unit(geo.metres_per_unit, keys);
  keys.real(kFalseEasting, map.parameters.easting);
  keys.real(kFalseNorthing, map.parameters.northing);
  if (map.method == 9810) {
    keys.number(kMethod, 15);  // CT_PolarStereographic
    keys.real(kNaturalLatitude, map.parameters.latitude);
    keys.real(kNaturalScale, map.parameters.scale);
    keys.real(kVerticalLongitude, map.parameters.longitude);
  } else {
    keys.number(kMethod, 17);  // CT_Equirectangular
    keys.real(kParallel1, map.parameters.parallel_1);
    keys.real(kCentreLatitude, map.parameters.latitude);
    keys.real(kCentreLongitude, map.parameters.longitude);
  }
}

/// A system by its code, or, of degrees, by its ellipsoid.
void write_system(const Georeference& geo, KeyWriter& keys) {
  const ReferenceSystem& system = geo.system;
  const bool projected = geo.unit == HorizontalUnit::kMetre;
  keys.number(kModelType, projected ? kModelProjected : kModelGeographic);
  keys.number(projected ? kProjectedCrs : kGeodeticCrs, code_or_user_defined(system.epsg));
  keys.text(kCitation, system.name);
  if (projected) {
    write_linear_unit(geo.metres_per_unit, keys);
  } else {
    // ESRI's names, "D_...", GDAL knows in WKT alone.
    const bool is_esri = !system.epsg && datum_names(system.wkt).datum.starts_with("D_");
    write_datum(system.name,
                system.epsg ? DatumNames{} : datum_names(is_esri ? wkt_of(system, WktDialect::kGdal) : system.wkt),
                system.semi_major_axis_m.value_or(6378137.0), keys);
  }
  if (!system.semi_major_axis_m) return;
  if (projected && !system.epsg) keys.number(kGeodeticCrs, kUserDefined);
  if (system.inverse_flattening) return write_ellipsoid(*system.semi_major_axis_m, *system.inverse_flattening, keys);
  keys.real(kSemiMajorAxis, *system.semi_major_axis_m);
}

/// A map without a code, in the way that ArcGIS and GDAL have for what keys cannot say: user-defined, and its WKT.
void write_wkt(const Georeference& geo, const std::string& wkt, KeyWriter& keys) {
  keys.number(kModelType, kUserDefined);
  keys.text(kCitation, geo.system.name);
  keys.text(kProjectedCitation, std::string(kEsri) + wkt);
  write_linear_unit(geo.metres_per_unit, keys);
}

/// GDAL reads this much of a citation.
constexpr std::size_t kLongestWkt = 2300;

/// The WKT of a map without a code; of two dialects the shorter one where the first is too long for GDAL.
std::string citation_wkt(const ReferenceSystem& system) {
  const bool is_alone = !system.vertical_epsg;
  if (is_alone && system.wkt.starts_with("PROJCS[") && system.wkt.size() <= kLongestWkt) return system.wkt;
  std::string wkt = wkt_of(system, WktDialect::kGdal);
  if (wkt.size() > kLongestWkt) wkt = wkt_of(system, WktDialect::kEsri);
  return wkt;
}

void write_vertical(const ReferenceSystem& system, double metres_per_unit, const std::string& unit, KeyWriter& keys) {
  if (system.vertical_epsg) keys.number(kVerticalCrs, code_or_user_defined(system.vertical_epsg));
  // What a code of three coordinates says already GDAL would take for a system of heights of its own.
  const bool is_said = system.epsg && system.vertical_datum == kAboveEllipsoid;
  if (!is_said) keys.text(kVerticalCitation, system.vertical_datum);
  // A unit alone GDAL would take for a system of heights.
  if (unit.empty() || (!system.vertical_epsg && system.vertical_datum.empty())) return;
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

GeoTags geotiff_tags(const Georeference& georeference, double metres_per_vertical_unit,
                     const std::string& vertical_unit) {
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
  // Areas are what a place without keys stands for, and GDAL makes a system of its own of any key.
  if (!has_unit && is_area && !tags.pixel_scale.empty() && vertical_unit.empty() &&
      georeference.system.vertical_datum.empty() && !georeference.system.vertical_epsg) {
    return tags;
  }
  KeyWriter keys(tags);
  keys.number(kRasterType, georeference.registration == Registration::kPoint ? kRasterIsPoint : kRasterIsArea);
  const bool by_wkt =
      georeference.unit == HorizontalUnit::kMetre && !georeference.system.epsg && !georeference.system.wkt.empty();
  const std::optional<KeyedMap> keyed =
      by_wkt && !georeference.system.vertical_epsg ? keyed_map(georeference.system.wkt) : std::nullopt;
  if (keyed) {
    write_keyed_map(georeference, *keyed, keys);
  } else if (by_wkt) {
    write_wkt(georeference, citation_wkt(georeference.system), keys);
  } else if (has_unit) {
    write_system(georeference, keys);
  }
  write_vertical(georeference.system, metres_per_vertical_unit, vertical_unit, keys);
  keys.finish();
  return tags;
}

}  // namespace isohf
