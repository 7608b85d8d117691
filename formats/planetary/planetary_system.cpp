#include "formats/planetary/planetary_system.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <string_view>

#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs/proj.h"
#include "isohf/projection/crs/source_system.h"

namespace isohf {
namespace {

/// A projection as labels name it, without blanks, and as PROJ does.
struct Method {
  std::string_view name;
  const char* proj;
};

constexpr std::string_view kPerspective = "POINTPERSPECTIVE";

constexpr std::array<Method, 22> kMethods = {{
    {"SIMPLECYLINDRICAL", "eqc +lon_0={lon}"},
    {"EQUIRECTANGULAR", "eqc +lat_ts={lat} +lon_0={lon}"},
    {"EQUIDISTANTCYLINDRICAL", "eqc +lat_ts={lat} +lon_0={lon}"},
    {"SINUSOIDAL", "sinu +lon_0={lon}"},
    {"POLARSTEREOGRAPHIC", "stere +lat_0={pole} +lon_0={lon} {true_scale}"},
    {"STEREOGRAPHIC", "stere +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {"MERCATOR", "merc +lon_0={lon} {true_scale}"},
    {"TRANSVERSEMERCATOR", "tmerc +lat_0={lat} +lon_0={lon} +k_0={k}"},
    {"ORTHOGRAPHIC", "ortho +lat_0={lat} +lon_0={lon}"},
    {"LAMBERTCONFORMAL", "lcc +lat_0={lat} +lon_0={lon} +lat_1={p1} +lat_2={p2}"},
    {"LAMBERTCONFORMALCONIC", "lcc +lat_0={lat} +lon_0={lon} +lat_1={p1} +lat_2={p2}"},
    {"LAMBERTAZIMUTHALEQUALAREA", "laea +lat_0={lat} +lon_0={lon}"},
    {"ALBERSCONICALEQUALAREA", "aea +lat_0={lat} +lon_0={lon} +lat_1={p1} +lat_2={p2}"},
    {"AZIMUTHALEQUIDISTANT", "aeqd +lat_0={lat} +lon_0={lon}"},
    {"EQUIDISTANTCONIC", "eqdc +lat_0={lat} +lon_0={lon} +lat_1={p1} +lat_2={p2}"},
    {"POLYCONIC", "poly +lat_0={lat} +lon_0={lon}"},
    {"GNOMONIC", "gnom +lat_0={lat} +lon_0={lon}"},
    {"ROBINSON", "robin +lon_0={lon}"},
    {"MILLERCYLINDRICAL", "mill +lon_0={lon}"},
    {"VANDERGRINTEN", "vandg +lon_0={lon}"},
    {kPerspective, "nsper +lat_0={lat} +lon_0={lon} +h={height}"},
    // Its pole's latitude is counted on beyond the body's pole, and turned the other way.
    {"OBLIQUECYLINDRICAL", "ob_tran +o_proj=eqc +o_lon_p={turn} +o_lat_p={o_lat} +lon_0={o_lon}"},
}};

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kUnsupported, why);
}

/// The WKT of a projection ("" for degrees) on an ellipsoid of the target, with the names that labels have: PROJ's own
/// strings have none. The projection is that of an ellipsoid, which PROJ and GDAL name otherwise on spheres.
std::string named_system(const PlanetaryMap& map, const std::string& projection, double radius_m, double flattening) {
  const proj::Context holder = proj::make_context();
  PJ_CONTEXT* const context = holder.get();
  const proj::Object axes(proj_create_ellipsoidal_2D_cs(context, PJ_ELLPS2D_LONGITUDE_LATITUDE, nullptr, 0.0));
  proj::Object system(proj_create_geographic_crs(context, ("GCS_" + map.target).c_str(), ("D_" + map.target).c_str(),
                                                 map.target.c_str(), radius_m, flattening, "Reference_Meridian", 0.0,
                                                 nullptr, 0.0, axes.get()));
  if (!projection.empty()) {
    const proj::Object flat(proj_create(context, ("+proj=" + projection + " +ellps=GRS80 +type=crs").c_str()));
    const proj::Object moved(flat && system ? proj_crs_alter_geodetic_crs(context, flat.get(), system.get()) : nullptr);
    system.reset(moved ? proj_alter_name(context, moved.get(), map.name.c_str()) : nullptr);
  }
  std::string wkt = system ? proj::wkt_of(context, system.get(), PJ_WKT2_2019) : std::string();
  if (wkt.empty()) refuse(fmt::format("PROJ does not take the map projection {}", printable(map.projection)));
  return wkt;
}

std::string system_of(const PlanetaryMap& map) {
  std::string kind;
  for (const char c : upper_case(map.projection)) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) kind += c;
  }
  const auto* const method = std::ranges::find(kMethods, kind, &Method::name);
  const double a = map.equatorial_radius_m.value_or(0.0);
  const double c = map.polar_radius_m.value_or(0.0) > 0.0 ? *map.polar_radius_m : a;
  const bool is_flat = !map.projection.empty();
  if (is_flat && (method == kMethods.end() || (method->name == kPerspective && !(map.distance_m > a)))) {
    refuse(fmt::format("the map projection {} is not known", printable(map.projection)));
  }
  if (!(a > 0.0)) refuse(fmt::format("the label gives no radius of {}", printable(map.target)));
  const std::string proj = is_flat ? method->proj : "";
  const bool is_cylinder = proj.starts_with("eqc");
  double radius = a;
  if (is_cylinder) {  // that of the ellipsoid where the scale is true
    const double latitude = kind == "SIMPLECYLINDRICAL" ? 0.0 : map.latitude * std::numbers::pi / 180.0;
    radius = a * c / std::hypot(c * std::cos(latitude), a * std::sin(latitude));
  } else if (kind == "POLARSTEREOGRAPHIC" || (proj.starts_with("stere") && std::abs(map.latitude) == 90.0)) {
    radius = c;
  }
  const bool on_sphere = is_cylinder || proj.starts_with("ob_tran") || !map.planetographic || a == c;
  // The scale is true on a parallel, or stated for a pole or the equator.
  const bool is_mercator = kind == "MERCATOR";
  const double parallel = is_mercator && map.parallel_1 != 0.0 ? map.parallel_1 : map.latitude;
  const bool is_stated = std::abs(parallel) == 90.0 || (is_mercator && parallel == 0.0);
  const std::string true_scale = is_stated ? fmt::format("+k_0={}", map.scale) : fmt::format("+lat_ts={}", parallel);
  const std::string text =
      fmt::format(fmt::runtime(proj), fmt::arg("lat", map.latitude), fmt::arg("lon", map.longitude),
                  fmt::arg("k", map.scale), fmt::arg("p1", map.parallel_1), fmt::arg("p2", map.parallel_2),
                  fmt::arg("true_scale", true_scale), fmt::arg("pole", map.latitude < 0.0 ? -90 : 90),
                  fmt::arg("height", map.distance_m - a), fmt::arg("turn", -map.pole_rotation),
                  fmt::arg("o_lat", 180.0 - map.pole.latitude), fmt::arg("o_lon", map.pole.longitude));
  return named_system(map, text, on_sphere ? radius : a, on_sphere ? 0.0 : a / (a - c));
}

}  // namespace

void take_planetary_map(const PlanetaryMap& map, SourceInfo& info) {
  Georeference& place = info.georeference;
  place.unit = map.projection.empty() ? HorizontalUnit::kDegree : HorizontalUnit::kMetre;
  if (!map.projection.empty() || map.equatorial_radius_m) {
    try {
      take_system(system_of(map), info);
    } catch (const Error& error) {
      info.warnings.push_back(loss(fmt::format("{}: coordinates are those of a map without a name", error.what())));
    }
  }
  ReferenceSystem& system = place.system;
  system.name = map.name;
  const bool is_unnamed = map.target.empty() || lower_case(map.target) == "unknown";
  system.body = body_of(map.target, is_unnamed ? map.equatorial_radius_m : std::nullopt);
  if (system.body.empty()) system.body = map.target;
  system.semi_major_axis_m = map.equatorial_radius_m;
  if (const auto& a = map.equatorial_radius_m) {
    const double c = map.polar_radius_m.value_or(*a);
    system.inverse_flattening = c == *a || !(c > 0.0) ? 0.0 : *a / (*a - c);
  }
}

}  // namespace isohf
