#include "isohf/projection/projection_wkt.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

namespace isohf {
namespace {

using Parameters = std::vector<std::pair<const char*, double>>;

/// Names of methods and parameters as OGC's 01-009 and GDAL have them.
std::pair<const char*, Parameters> method_of(const ProjectionSpec& spec) {
  const std::pair<const char*, double> easting{"false_easting", spec.false_easting};
  const std::pair<const char*, double> northing{"false_northing", spec.false_northing};
  switch (spec.kind) {
    case ProjectionKind::kEquirectangular:
      return {"Equirectangular",
              {{"standard_parallel_1", spec.latitude_0}, {"central_meridian", spec.longitude_0}, easting, northing}};
    case ProjectionKind::kLocal:
      return {"Azimuthal_Equidistant",
              {{"latitude_of_center", spec.latitude_0}, {"longitude_of_center", spec.longitude_0}, easting, northing}};
    case ProjectionKind::kTransverseMercator:
    case ProjectionKind::kUtm:
      return {"Transverse_Mercator",
              {{"latitude_of_origin", spec.latitude_0},
               {"central_meridian", spec.longitude_0},
               {"scale_factor", spec.scale_0},
               easting,
               northing}};
    case ProjectionKind::kLambertConformal:
      if (spec.parallel_1 == -spec.parallel_2) {
        return {"Mercator_2SP",
                {{"standard_parallel_1", std::abs(spec.parallel_1)},
                 {"central_meridian", spec.longitude_0},
                 easting,
                 northing}};
      }
      return {"Lambert_Conformal_Conic_2SP",
              {{"standard_parallel_1", spec.parallel_1},
               {"standard_parallel_2", spec.parallel_2},
               {"latitude_of_origin", spec.latitude_0},
               {"central_meridian", spec.longitude_0},
               easting,
               northing}};
    case ProjectionKind::kPolarStereographic:
      return {"Polar_Stereographic",
              {{"latitude_of_origin", spec.parallel_1},
               {"central_meridian", spec.longitude_0},
               {"scale_factor", 1.0},
               easting,
               northing}};
    case ProjectionKind::kNone:
    case ProjectionKind::kSystem:
      break;
  }
  return {"", {}};
}

bool is_wgs84(const Ellipsoid& ellipsoid) {
  return ellipsoid == Ellipsoid{};
}

/// Quotes end names.
std::string quoted(std::string name) {
  std::replace(name.begin(), name.end(), '"', '\'');
  return '"' + name + '"';
}

}  // namespace

std::string projection_wkt(const ProjectionSpec& spec, const std::string& geographic_name) {
  if (spec.kind == ProjectionKind::kSystem) return spec.system.text;
  const auto [method, parameters] = method_of(spec);
  const bool wgs84 = is_wgs84(spec.ellipsoid);
  const std::string name = geographic_name.empty() ? (wgs84 ? "WGS 84" : "unknown") : geographic_name;
  std::string text = fmt::format(
      "PROJCS[{},GEOGCS[{},DATUM[{},SPHEROID[{},{},{}]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],"
      "PROJECTION[\"{}\"]",
      quoted(to_string(spec.kind)), quoted(name), wgs84 ? "\"WGS_1984\"" : quoted("unknown based on " + name),
      wgs84 ? "\"WGS 84\"" : quoted(name), spec.ellipsoid.semi_major_axis_m, spec.ellipsoid.inverse_flattening, method);
  for (const auto& [parameter, value] : parameters) text += fmt::format(",PARAMETER[\"{}\",{}]", parameter, value);
  return text + ",UNIT[\"metre\",1],AXIS[\"Easting\",EAST],AXIS[\"Northing\",NORTH]]";
}

std::optional<int> projection_epsg(const ProjectionSpec& spec, std::optional<int> geographic_epsg) {
  constexpr int kWgs84 = 4326;
  if (spec.kind == ProjectionKind::kSystem && spec.system.text.starts_with("EPSG:")) {
    return std::atoi(spec.system.text.c_str() + 5);
  }
  if (spec.kind != ProjectionKind::kUtm || geographic_epsg != kWgs84 || !is_wgs84(spec.ellipsoid)) return std::nullopt;
  return spec.utm_zone > 0 ? 32600 + spec.utm_zone : 32700 - spec.utm_zone;
}

std::string describe_projection(const ProjectionSpec& spec) {
  const std::string kind = to_string(spec.kind);
  switch (spec.kind) {
    case ProjectionKind::kNone:
      return kind;
    case ProjectionKind::kEquirectangular:
      return fmt::format("{}, true at latitude {:.6g}", kind, spec.latitude_0);
    case ProjectionKind::kLocal:
      return fmt::format("{} (azimuthal equidistant) around longitude {:.8g}, latitude {:.8g}", kind, spec.longitude_0,
                         spec.latitude_0);
    case ProjectionKind::kTransverseMercator:
      return fmt::format("{} around longitude {:.8g}, scale {:.6g} there", kind, spec.longitude_0, spec.scale_0);
    case ProjectionKind::kUtm:
      return fmt::format("{} zone {}{}", kind, std::abs(spec.utm_zone), spec.utm_zone > 0 ? "N" : "S");
    case ProjectionKind::kLambertConformal:
      return fmt::format("{} around longitude {:.8g}, true at latitudes {:.8g} and {:.8g}", kind, spec.longitude_0,
                         spec.parallel_1, spec.parallel_2);
    case ProjectionKind::kPolarStereographic:
      return fmt::format("{} around longitude {:.8g}, true at latitude {:.8g}", kind, spec.longitude_0,
                         spec.parallel_1);
    case ProjectionKind::kSystem: {
      const bool is_code = spec.system.text.find('[') == std::string::npos;
      if (spec.system.name.empty()) return spec.system.text;
      return is_code ? fmt::format("{} ({})", spec.system.name, spec.system.text) : spec.system.name;
    }
  }
  return kind;
}

}  // namespace isohf
