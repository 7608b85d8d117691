#include "isohf/projection/crs/source_system.h"

#include <fmt/format.h>

#include <cmath>

#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs/crs.h"

namespace isohf {
namespace {

[[noreturn]] void refuse(const std::string& name, const char* why, const char* remedy) {
  throw Error(ErrorCode::kUnsupported, fmt::format("the reference system \"{}\" {}; {}", name, why, remedy));
}

void take_vertical(const Crs::Description& found, SourceInfo& info) {
  if (found.vertical_name.empty()) return;
  if (found.metres_per_vertical_unit < 0.0) {
    refuse(found.vertical_name, "counts depths downwards",
           "isohf reads heights; name the system without it, and give `z_scale` -1");
  }
  info.georeference.system.vertical_datum = found.vertical_name;
  info.georeference.system.vertical_epsg = found.vertical_epsg;
  info.vertical_unit = found.vertical_unit;
  info.metres_per_vertical_unit = found.metres_per_vertical_unit;
}

/// WKT stays as a file has it; any other text names the system for PROJ alone.
bool is_wkt(const std::string& text) {
  return text.find('[') != std::string::npos && text.find('{') == std::string::npos;
}

}  // namespace

void take_system(const std::string& text, SourceInfo& info) {
  const auto crs = Crs::parse(text);
  const Crs::Description& found = crs->description();
  constexpr double kSame = 1e-9;  // files give 12 to 17 digits of a degree
  if (!found.is_projected && (std::abs(found.unit - 1.0) > kSame || std::abs(found.prime_meridian_deg) > kSame)) {
    refuse(shown_name(found.name, text), "counts no degrees from Greenwich",
           "gdalwarp brings the raster to one that does");
  }
  Georeference& place = info.georeference;
  place.unit = found.is_projected ? HorizontalUnit::kMetre : HorizontalUnit::kDegree;
  place.metres_per_unit = found.is_projected ? found.unit : 1.0;
  ReferenceSystem system;
  system.name = found.name;
  system.semi_major_axis_m = found.ellipsoid.semi_major_axis_m;
  system.inverse_flattening = found.ellipsoid.inverse_flattening;
  system.body = body_of(found.name + ' ' + found.datum, system.semi_major_axis_m);
  system.vertical_datum = place.system.vertical_datum;
  system.vertical_epsg = place.system.vertical_epsg;
  system.epsg = crs->identified();
  if (!system.epsg) system.wkt = is_wkt(text) ? text : crs->wkt(WktDialect::kWkt2);
  place.system = system;
  take_vertical(found, info);
}

void take_heights(int vertical_epsg, SourceInfo& info) {
  constexpr const char* kAny = "EPSG:4326";
  try {
    take_vertical(Crs::parse(kAny, std::nullopt, vertical_epsg)->description(), info);
  } catch (const Error& error) {
    info.warnings.push_back(
        fmt::format("the unit of heights in EPSG:{} is not known: {}", vertical_epsg, error.what()));
  }
}

bool gives_heights_above_ellipsoid(int epsg) {
  // EPSG keeps these ranges for systems of two dimensions: WGS 84, ETRS89, NAD83 and most others.
  if ((epsg >= 4120 && epsg <= 4326) || (epsg >= 4600 && epsg <= 4826)) return false;
  try {
    return Crs::parse(fmt::format("EPSG:{}", epsg))->description().vertical_name == kAboveEllipsoid;
  } catch (const Error&) {
    return false;
  }
}

std::string unit_name(const Georeference& place) {
  if (place.unit == HorizontalUnit::kUnknown) return "an unknown unit";
  if (place.unit == HorizontalUnit::kDegree) return "degrees";
  return place.metres_per_unit == 1.0 ? "metres" : fmt::format("units of {} m", place.metres_per_unit);
}

std::string name_of(const Georeference& place) {
  const ReferenceSystem& system = place.system;
  if (system.epsg) return fmt::format("EPSG:{}", *system.epsg);
  return system.name.empty() ? unit_name(place) : "\"" + shown_name(system.name, system.wkt) + "\"";
}

ReferenceSystem wgs84_system() {
  ReferenceSystem system;
  system.name = "WGS 84";
  system.epsg = 4326;
  system.body = "Earth";
  system.semi_major_axis_m = 6378137.0;
  system.inverse_flattening = 298.257223563;
  return system;
}

}  // namespace isohf
