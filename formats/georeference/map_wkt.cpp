#include "formats/georeference/map_wkt.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>

#include "formats/io/text.h"
#include "isohf/projection/length_unit.h"

namespace isohf {
namespace {

/// A method as keys and WKT 1 name it: what its origin is called there, and which parameters it has besides: 1 and 2 are
/// standard parallels, k a scale, h a height, a the azimuth and the angle of the grid.
struct Method {
  int code;
  std::string_view name;
  const char* latitude;  ///< nullptr: it has none
  const char* longitude;
  std::string_view parameters;
};

constexpr const char* kOriginLatitude = "latitude_of_origin";
constexpr const char* kMeridian = "central_meridian";
constexpr const char* kMiddleLatitude = "latitude_of_center";
constexpr const char* kMiddleLongitude = "longitude_of_center";

// Codes: GeoTIFF 1.0, section 6.3.3.3; names: OGC 01-009 and GDAL.
constexpr std::array<Method, 28> kMethods = {{
    {1, "Transverse_Mercator", kOriginLatitude, kMeridian, "k"},
    {3, "Hotine_Oblique_Mercator_Azimuth_Center", kMiddleLatitude, kMiddleLongitude, "ka"},
    {9812, "Hotine_Oblique_Mercator", kMiddleLatitude, kMiddleLongitude, "ka"},
    {9815, "Hotine_Oblique_Mercator_Azimuth_Center", kMiddleLatitude, kMiddleLongitude, "ka"},
    {5, "Swiss_Oblique_Cylindrical", kMiddleLatitude, kMiddleLongitude, ""},
    {7, "Mercator_1SP", kOriginLatitude, kMeridian, "k"},
    {0, "Mercator_2SP", nullptr, kMeridian, "1"},
    {8, "Lambert_Conformal_Conic_2SP", kOriginLatitude, kMeridian, "12"},
    {9, "Lambert_Conformal_Conic_1SP", kOriginLatitude, kMeridian, "k"},
    {10, "Lambert_Azimuthal_Equal_Area", kMiddleLatitude, kMiddleLongitude, ""},
    {11, "Albers_Conic_Equal_Area", kMiddleLatitude, kMiddleLongitude, "12"},
    {12, "Azimuthal_Equidistant", kMiddleLatitude, kMiddleLongitude, ""},
    {13, "Equidistant_Conic", kMiddleLatitude, kMiddleLongitude, "12"},
    {14, "Stereographic", kOriginLatitude, kMeridian, "k"},
    {15, "Polar_Stereographic", kOriginLatitude, kMeridian, "k"},
    {16, "Oblique_Stereographic", kOriginLatitude, kMeridian, "k"},
    {17, "Equirectangular", kOriginLatitude, kMeridian, "1"},
    {18, "Cassini_Soldner", kOriginLatitude, kMeridian, ""},
    {19, "Gnomonic", kOriginLatitude, kMeridian, ""},
    {20, "Miller_Cylindrical", kMiddleLatitude, kMiddleLongitude, ""},
    {21, "Orthographic", kOriginLatitude, kMeridian, ""},
    {22, "Polyconic", kOriginLatitude, kMeridian, ""},
    {23, "Robinson", nullptr, kMiddleLongitude, ""},
    {24, "Sinusoidal", nullptr, kMiddleLongitude, ""},
    {25, "VanDerGrinten", nullptr, kMeridian, ""},
    {26, "New_Zealand_Map_Grid", kOriginLatitude, kMeridian, ""},
    {28, "Cylindrical_Equal_Area", nullptr, kMeridian, "1"},
    {0, "Vertical_Near_Side_Perspective", kMiddleLatitude, kMiddleLongitude, "h"},
}};

/// Quotes end names.
std::string quoted(std::string name) {
  std::replace(name.begin(), name.end(), '"', '\'');
  return '"' + name + '"';
}

/// A cylinder about another axis, which WKT has no word for, as PROJ spells it: its pole's latitude is counted on beyond
/// the body's pole there, and turned the other way.
std::string oblique_wkt(const std::string& name, const std::string& geographic, const PlanetaryMap& map) {
  return fmt::format(
      "PROJCS[{},{},PROJECTION[\"custom_proj4\"],UNIT[\"metre\",1],AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH],"
      "EXTENSION[\"PROJ4\",\"+proj=ob_tran +o_proj=eqc +o_lon_p={} +o_lat_p={} +lon_0={} +R={}\"]]",
      quoted(name), geographic, -map.pole_rotation, 180.0 - map.pole.latitude, map.pole.longitude,
      map.equatorial_radius_m);
}

}  // namespace

const char* meridian_of(double semi_major_axis_m) {
  return std::abs(semi_major_axis_m / 6378137.0 - 1.0) < 0.01 ? "Greenwich" : "Reference_Meridian";
}

std::string_view method_of_code(int code) {
  const auto* const found = std::ranges::find(kMethods, code, &Method::code);
  return code == 0 || found == kMethods.end() ? std::string_view() : found->name;
}

std::string map_wkt(const std::string& name, const std::string& geographic, std::string_view method,
                    const MapParameters& parameters, double metres_per_unit) {
  const auto* const found = std::ranges::find(kMethods, method, &Method::name);
  if (found == kMethods.end()) return {};
  // Where WKT 1 has one name for two methods of EPSG's: labels and keys mean the first, as GDAL reads them.
  const char* const code = method == "Equirectangular"       ? R"(,AUTHORITY["EPSG","1028"])"
                           : method == "Polar_Stereographic" ? R"(,AUTHORITY["EPSG","9810"])"
                                                             : "";
  std::string text = fmt::format("PROJCS[{},{},PROJECTION[\"{}\"{}]", quoted(name), geographic, method, code);
  const auto add = [&](const char* what, double value) { text += fmt::format(",PARAMETER[\"{}\",{}]", what, value); };
  if (found->latitude != nullptr) add(found->latitude, parameters.latitude);
  add(found->longitude, parameters.longitude);
  for (const char parameter : found->parameters) {
    if (parameter == '1') add("standard_parallel_1", parameters.parallel_1);
    if (parameter == '2') add("standard_parallel_2", parameters.parallel_2);
    if (parameter == 'k') add("scale_factor", parameters.scale);
    if (parameter == 'h') add("Height", parameters.height);
    if (parameter != 'a') continue;
    add("azimuth", parameters.azimuth);
    add("rectified_grid_angle", parameters.grid_angle);
  }
  add("false_easting", parameters.easting);
  add("false_northing", parameters.northing);
  return text + fmt::format(",UNIT[\"{}\",{}],AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH]]",
                            linear_unit_name(metres_per_unit), metres_per_unit);
}

std::string geographic_wkt(const std::string& name, const std::string& datum, const std::string& ellipsoid,
                           double semi_major_axis_m, double inverse_flattening, const std::string& meridian,
                           double degrees_per_unit) {
  const bool is_degree = degrees_per_unit == 1.0;
  const std::string from = meridian.empty() ? meridian_of(semi_major_axis_m) : meridian;
  return fmt::format("GEOGCS[{},DATUM[{},SPHEROID[{},{},{}]],PRIMEM[{},0],UNIT[\"{}\",{}]]", quoted(name),
                     quoted(datum), quoted(ellipsoid), semi_major_axis_m, inverse_flattening, quoted(from),
                     is_degree ? "degree" : "angle",
                     is_degree ? 0.0174532925199433 : degrees_per_unit * std::numbers::pi / 180.0);
}

std::string planetary_wkt(const PlanetaryMap& map, std::vector<Warning>& warnings) {
  std::string kind;
  for (const char c : upper_case(map.projection)) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) kind += c;
  }
  struct Known {
    std::string_view kind;
    std::string_view method;
  };
  static constexpr std::string_view kOblique = "oblique";
  static constexpr std::array<Known, 23> kKnown = {{{"SIMPLECYLINDRICAL", "Equirectangular"},
                                                    {"EQUIRECTANGULAR", "Equirectangular"},
                                                    {"EQUIDISTANTCYLINDRICAL", "Equirectangular"},
                                                    {"SINUSOIDAL", "Sinusoidal"},
                                                    {"POLARSTEREOGRAPHIC", "Polar_Stereographic"},
                                                    {"STEREOGRAPHIC", "Stereographic"},
                                                    {"MERCATOR", "Mercator_1SP"},
                                                    {"TRANSVERSEMERCATOR", "Transverse_Mercator"},
                                                    {"ORTHOGRAPHIC", "Orthographic"},
                                                    {"LAMBERTCONFORMAL", "Lambert_Conformal_Conic_2SP"},
                                                    {"LAMBERTCONFORMALCONIC", "Lambert_Conformal_Conic_2SP"},
                                                    {"LAMBERTAZIMUTHALEQUALAREA", "Lambert_Azimuthal_Equal_Area"},
                                                    {"ALBERSCONICALEQUALAREA", "Albers_Conic_Equal_Area"},
                                                    {"AZIMUTHALEQUIDISTANT", "Azimuthal_Equidistant"},
                                                    {"EQUIDISTANTCONIC", "Equidistant_Conic"},
                                                    {"POLYCONIC", "Polyconic"},
                                                    {"GNOMONIC", "Gnomonic"},
                                                    {"ROBINSON", "Robinson"},
                                                    {"MILLERCYLINDRICAL", "Miller_Cylindrical"},
                                                    {"VANDERGRINTEN", "VanDerGrinten"},
                                                    {"POINTPERSPECTIVE", "Vertical_Near_Side_Perspective"},
                                                    {"OBLIQUECYLINDRICAL", kOblique},
                                                    {"", ""}}};
  const auto* const known = std::ranges::find(kKnown, kind, &Known::kind);
  const bool is_sized = map.equatorial_radius_m > 0.0;
  MapParameters parameters = map.parameters;
  parameters.height = map.distance_m - map.equatorial_radius_m;
  const bool is_told =
      known != kKnown.end() && (known->method != "Vertical_Near_Side_Perspective" || parameters.height > 0.0);
  if (!is_told || !is_sized) {
    if (is_sized || !kind.empty()) {
      warnings.push_back(loss(
          !is_told ? fmt::format("the map projection {} is not known: coordinates are metres of a map without a name",
                                 printable(map.projection))
                   : fmt::format("the label gives no radius of {}: coordinates are metres of a map without a name",
                                 printable(map.target))));
    }
    return {};
  }
  const double a = map.equatorial_radius_m;
  const double c = map.polar_radius_m > 0.0 ? map.polar_radius_m : a;
  double radius = a;
  const bool is_cylinder = known->method == "Equirectangular";
  if (is_cylinder) {
    parameters.parallel_1 = kind == "SIMPLECYLINDRICAL" ? 0.0 : parameters.latitude;
    parameters.latitude = 0.0;
    const double latitude = parameters.parallel_1 * std::numbers::pi / 180.0;
    radius = a * c / std::hypot(c * std::cos(latitude), a * std::sin(latitude));
  } else if (known->method == "Polar_Stereographic" ||
             (known->method == "Stereographic" && std::abs(parameters.latitude) == 90.0)) {
    radius = c;
  }
  const bool is_oblique = known->method == kOblique;
  const bool on_sphere = is_cylinder || is_oblique || !map.planetographic || a == c;
  const std::string beneath = geographic_wkt("GCS_" + map.target, "D_" + map.target, map.target, on_sphere ? radius : a,
                                             on_sphere ? 0.0 : a / (a - c), "Reference_Meridian");
  if (known->method.empty()) return beneath;
  const std::string name = map.projection + ' ' + map.target;
  if (is_oblique) return oblique_wkt(name, beneath, map);
  const bool is_secant = known->method == "Mercator_1SP" && parameters.parallel_1 != 0.0;
  return map_wkt(name, beneath, is_secant ? "Mercator_2SP" : known->method, parameters, 1.0);
}

}  // namespace isohf
