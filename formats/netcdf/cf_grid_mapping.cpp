#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "formats/netcdf/cf_raster.h"

namespace isohf {
namespace {

struct Projection {
  std::string_view name;  ///< in CF, appendix F
  const char* proj;
  std::string_view parallel;  ///< what a standard parallel is to PROJ; empty: it has none
};
constexpr std::array<Projection, 11> kProjections = {{{"transverse_mercator", "tmerc", ""},
                                                      {"mercator", "merc", "lat_ts"},
                                                      {"polar_stereographic", "stere", "lat_ts"},
                                                      {"stereographic", "stere", ""},
                                                      {"lambert_conformal_conic", "lcc", "lat_1"},
                                                      {"albers_conical_equal_area", "aea", "lat_1"},
                                                      {"lambert_azimuthal_equal_area", "laea", ""},
                                                      {"azimuthal_equidistant", "aeqd", ""},
                                                      {"lambert_cylindrical_equal_area", "cea", "lat_ts"},
                                                      {"orthographic", "ortho", ""},
                                                      {"sinusoidal", "sinu", ""}}};

std::string term(std::string_view key, double value) {
  return fmt::format(" +{}={:.17g}", key, value);
}

/// The ellipsoid and prime meridian, as PROJ spells them; empty for those of WGS 84.
std::string figure_of(const NetcdfFile& file, int mapping) {
  const auto number = [&](const char* key) { return file.number(mapping, key).value_or(0.0); };
  const double axis = number("semi_major_axis");
  const double flattening = number("inverse_flattening");
  const double other_axis = number("semi_minor_axis");
  std::string figure;
  if (axis != 0.0) {
    const bool is_wgs84 = axis == 6378137.0 && std::abs(flattening - 298.257223563) < 1e-6;
    const std::string shape =
        flattening > 0.0 ? term("rf", flattening) : term("b", other_axis > 0.0 ? other_axis : axis);
    figure = is_wgs84 ? "" : term("a", axis) + shape;
  } else if (const double radius = number("earth_radius"); radius != 0.0) {
    figure = term("R", radius);
  }
  const double meridian = number("longitude_of_prime_meridian");
  return meridian == 0.0 ? figure : (figure.empty() ? " +ellps=WGS84" : figure) + term("pm", meridian);
}

/// A map by its parameters; empty for one that is not in the table.
std::string map_of(const NetcdfFile& file, int mapping, std::string_view name, double metres_per_unit) {
  const auto* const found = std::ranges::find(kProjections, name, &Projection::name);
  if (found == kProjections.end()) return {};
  std::string map = fmt::format("+proj={}", found->proj);
  const std::vector<double> parallels = file.numbers(mapping, "standard_parallel");
  const bool has_parallel = !parallels.empty() && !found->parallel.empty();
  if (has_parallel) map += term(found->parallel, parallels.front());
  if (has_parallel && found->parallel == "lat_1") map += term("lat_2", parallels.back());
  if (name == "polar_stereographic" && !file.number(mapping, "latitude_of_projection_origin")) {
    map += term("lat_0", has_parallel && parallels.front() < 0.0 ? -90.0 : 90.0);
  }
  for (const auto& [key, proj, scale] : {std::tuple{"latitude_of_projection_origin", "lat_0", 1.0},
                                         {"longitude_of_projection_origin", "lon_0", 1.0},
                                         {"longitude_of_central_meridian", "lon_0", 1.0},
                                         {"straight_vertical_longitude_from_pole", "lon_0", 1.0},
                                         {"scale_factor_at_central_meridian", "k_0", 1.0},
                                         {"scale_factor_at_projection_origin", "k_0", 1.0},
                                         {"false_easting", "x_0", metres_per_unit},
                                         {"false_northing", "y_0", metres_per_unit}}) {
    if (const auto value = file.number(mapping, key)) map += term(proj, *value * scale);
  }
  const std::string figure = figure_of(file, mapping);
  return map + (figure.empty() ? " +datum=WGS84" : figure) + " +no_defs +type=crs";
}

}  // namespace

GridMapping grid_mapping_of(const NetcdfFile& file, const NetcdfFile::Variable& variable, double metres_per_unit) {
  // "crs", or "crs: x y other: lat lon"
  const std::string called = file.text(variable.id, "grid_mapping");
  const auto* const mapping = file.variable(called.substr(0, called.find_first_of(": ")));
  if (mapping == nullptr) return {};
  GridMapping found{file.text(mapping->id, "grid_mapping_name"), ""};
  if (found.name.starts_with("rotated_")) return found;  // degrees of another pole, whatever a WKT says
  // GDAL, NSIDC and others call it so.
  for (const char* key :
       {"crs_wkt", "spatial_ref", "epsg_code", "proj4", "proj4text", "proj4_params", "proj4_string"}) {
    if (found.system.empty()) found.system = file.text(mapping->id, key);
  }
  if (!found.system.empty()) return found;
  if (const auto code = file.number(mapping->id, "spatial_epsg")) {
    found.system = fmt::format("EPSG:{:.0f}", *code);
  } else if (found.name.empty() || found.name == "latitude_longitude") {
    const std::string figure = figure_of(file, mapping->id);
    if (!figure.empty()) found.system = "+proj=longlat" + figure + " +no_defs +type=crs";
  } else {
    found.system = map_of(file, mapping->id, found.name, metres_per_unit);
  }
  return found;
}

}  // namespace isohf
