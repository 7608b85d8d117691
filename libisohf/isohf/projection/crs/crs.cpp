#include "isohf/projection/crs/crs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <string_view>
#include <utility>

#include "isohf/base/text/text.h"
#include "isohf/error.h"
#include "isohf/projection/reference_map.h"

namespace isohf {
namespace {

using proj::Object;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kUnsupported, why);
}

[[noreturn]] void refuse_text(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

/// For messages, of what may be a WKT of any length.
std::string shortened(const std::string& text) {
  return one_line(text.size() > 60 ? text.substr(0, 60) + "..." : text);
}

/// PROJ takes its own strings for operations unless they say that they are systems.
std::string as_system(const std::string& text) {
  const bool is_string = text.find("+proj=") != std::string::npos || text.find("+init=") != std::string::npos;
  return is_string && text.find("+type=crs") == std::string::npos ? text + " +type=crs" : text;
}

/// PROJ takes any word for the first name in which it finds it: "foo" for "Amersfoort".
void check_name(const std::string& text, const char* found) {
  if (text.find_first_of(":[{+=") != std::string::npos) return;
  const auto letters = [](std::string_view name) {
    std::string kept;
    for (const char c : lower_case(name)) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0) kept += c;
    }
    return kept;
  };
  if (found != nullptr && letters(text) == letters(found)) return;
  refuse_text("it is the name of none" +
              (found != nullptr ? std::string(": \"") + found + "\" is the nearest" : std::string()) +
              "; EPSG:2154, WKT, a PROJ string or a whole name is wanted");
}

Object system_of_text(PJ_CONTEXT* context, const std::string& text) {
  Object system(proj_create(context, as_system(text).c_str()));
  if (system) {
    check_name(text, proj_get_name(system.get()));
    return system;
  }
  if (proj_context_get_database_path(context) == nullptr) {
    throw Error(
        ErrorCode::kIo,
        "PROJ finds no proj.db (Debian package proj-data; the environment variable PROJ_DATA names its folder)");
  }
  const int code = proj_context_errno(context);
  const char* const why = code != 0 && code != PROJ_ERR_OTHER ? proj_context_errno_string(context, code) : nullptr;
  refuse_text(std::string("PROJ does not understand it") + (why != nullptr ? std::string(": ") + why : ""));
}

/// What is left of a system without its heights and bindings to other datums.
Object horizontal_part(PJ_CONTEXT* context, const PJ* system) {
  Object part(proj_clone(context, system));
  for (;;) {
    switch (proj_get_type(part.get())) {
      case PJ_TYPE_BOUND_CRS:
        part.reset(proj_get_source_crs(context, part.get()));
        break;
      case PJ_TYPE_COMPOUND_CRS:
        part.reset(proj_crs_get_sub_crs(context, part.get(), 0));
        break;
      case PJ_TYPE_GEOGRAPHIC_3D_CRS:
      case PJ_TYPE_GEOGRAPHIC_2D_CRS:
        if (proj_is_derived_crs(context, part.get()) == 0) return part;
        refuse("counts degrees about a rotated pole; gdalwarp -t_srs EPSG:4326 makes longitudes and latitudes of them");
      case PJ_TYPE_PROJECTED_CRS:
        return part;
      default:
        refuse_text(std::string("is no projected or geographic reference system, but \"") +
                    (part && proj_get_name(part.get()) != nullptr ? proj_get_name(part.get()) : "") + "\"");
    }
  }
}

/// The unit of both axes, in metres or radians. Refuses axes that nothing in a north-up raster lies along.
double unit_of(PJ_CONTEXT* context, const PJ* system) {
  const Object axes(proj_crs_get_coordinate_system(context, system));
  std::array<double, 2> unit{};
  for (int axis = 0; axis < 2; ++axis) {
    const char* direction = nullptr;
    if (!axes || proj_cs_get_axis_info(context, axes.get(), axis, nullptr, nullptr, &direction,
                                       &unit[static_cast<std::size_t>(axis)], nullptr, nullptr, nullptr) == 0) {
      refuse("has axes that PROJ does not tell");
    }
    // South is no sign: at a pole both axes of a map run the same way.
    if (std::string_view(direction) == "west") {
      refuse("has an axis that runs westwards; gdalwarp brings the raster to a system that counts East");
    }
  }
  if (unit[0] != unit[1] || !(unit[0] > 0.0)) refuse("has axes of different units");
  return unit[0];
}

/// PROJ's database has 15 digits of it.
double exact(double metres) {
  constexpr double kUsFoot = 1200.0 / 3937.0;
  return std::abs(metres - kUsFoot) < 1e-14 ? kUsFoot : metres;
}

/// Radii are written with more or fewer digits.
bool are_alike(const Ellipsoid& a, const Ellipsoid& b) {
  return std::abs(a.semi_major_axis_m / b.semi_major_axis_m - 1.0) < 1e-9 &&
         std::abs(a.inverse_flattening - b.inverse_flattening) < 1e-6;
}

const char* or_empty(const char* text) {
  return text != nullptr ? text : "";
}

}  // namespace

std::string shown_name(const std::string& name, const std::string& text) {
  return name.empty() || name == "unknown" ? shortened(text) : name;
}

Crs::Crs(const std::string& text, std::optional<double> metres_per_unit, std::optional<int> vertical_epsg)
    : context_(proj::make_context()) {
  PJ_CONTEXT* const context = context_.get();
  try {
    whole_ = system_of_text(context, text);
    horizontal_ = horizontal_part(context, whole_.get());
    if (vertical_epsg && proj_get_type(whole_.get()) != PJ_TYPE_COMPOUND_CRS) {
      const Object vertical(proj_create(context, fmt::format("EPSG:{}", *vertical_epsg).c_str()));
      const std::string name = vertical ? std::string(or_empty(proj_get_name(horizontal_.get()))) + " + " +
                                              or_empty(proj_get_name(vertical.get()))
                                        : std::string();
      Object both(vertical ? proj_create_compound_crs(context, name.c_str(), horizontal_.get(), vertical.get())
                           : nullptr);
      if (both) whole_ = std::move(both);
    }
    describe();
  } catch (const Error& error) {
    throw Error(error.code(), fmt::format("the reference system {}: {}", shortened(text), error.what()));
  }
  metres_per_unit_ = description_.is_projected ? metres_per_unit.value_or(description_.unit) : 1.0;
  scale_ = description_.is_projected ? metres_per_unit_ / description_.unit : 1.0;
}

void Crs::describe() {
  PJ_CONTEXT* const context = context_.get();
  const PJ* const part = horizontal_.get();
  description_.is_projected = proj_get_type(part) == PJ_TYPE_PROJECTED_CRS;
  description_.is_compound = proj_get_type(whole_.get()) == PJ_TYPE_COMPOUND_CRS;
  description_.name = one_line(or_empty(proj_get_name(part)));
  description_.authority = or_empty(proj_get_id_auth_name(part, 0));
  description_.code = or_empty(proj_get_id_code(part, 0));
  if (const int code = proj::epsg_of(part); code > 0) description_.epsg = code;
  const double unit = unit_of(context, part);
  description_.unit = exact(description_.is_projected ? unit : unit * proj::kDegreesPerRadian);
  describe_datum();
  describe_heights();
}

void Crs::describe_datum() {
  PJ_CONTEXT* const context = context_.get();
  const PJ* const part = horizontal_.get();
  const Object geographic(proj_crs_get_geodetic_crs(context, part));
  const Object ellipsoid(proj_get_ellipsoid(context, part));
  if (!geographic || !ellipsoid) refuse("names no ellipsoid");
  Object datum(proj_crs_get_datum(context, geographic.get()));
  if (!datum) datum.reset(proj_crs_get_datum_ensemble(context, geographic.get()));
  description_.datum = one_line(or_empty(proj_get_name(datum ? datum.get() : geographic.get())));
  description_.is_datum_known = std::ranges::none_of(
      std::array{"unknown", "not specified", "not_specified", "undefined"},
      [name = lower_case(description_.datum)](const char* word) { return name.find(word) != std::string::npos; });
  proj_ellipsoid_get_parameters(context, ellipsoid.get(), &description_.ellipsoid.semi_major_axis_m, nullptr, nullptr,
                                &description_.ellipsoid.inverse_flattening);
  if (!(description_.ellipsoid.semi_major_axis_m > 0.0)) refuse("names no ellipsoid");

  const Object meridian(proj_get_prime_meridian(context, geographic.get()));
  double longitude = 0.0;
  double radians = 0.0;
  if (meridian) proj_prime_meridian_get_parameters(context, meridian.get(), &longitude, &radians, nullptr);
  description_.prime_meridian_deg = longitude * radians * proj::kDegreesPerRadian;
  degrees_per_unit_ = unit_of(context, geographic.get()) * proj::kDegreesPerRadian;

  const Object operation(proj_create_crs_to_crs_from_pj(context, part, geographic.get(), nullptr, nullptr));
  const Object to_geo(operation ? proj_normalize_for_visualization(context, operation.get()) : nullptr);
  if (!to_geo) refuse("has no way to longitudes and latitudes that PROJ knows");
  to_geo_.emplace(to_geo.get(), ProjOperation::Runs::kToGeo, degrees_per_unit_, description_.prime_meridian_deg);
  if (description_.is_projected) to_geo_->find_outline();
}

/// Of a compound system its second part; else the third axis, which counts from the ellipsoid.
void Crs::describe_heights() {
  PJ_CONTEXT* const context = context_.get();
  const bool is_compound = description_.is_compound;
  const Object vertical(is_compound ? proj_crs_get_sub_crs(context, whole_.get(), 1)
                                    : proj_clone(context, horizontal_.get()));
  const Object axes(vertical ? proj_crs_get_coordinate_system(context, vertical.get()) : nullptr);
  constexpr int kHeight = 2;
  if (!axes || (!is_compound && proj_cs_get_axis_count(context, axes.get()) <= kHeight)) return;
  const char* direction = nullptr;
  const char* unit = nullptr;
  double metres = 1.0;
  if (proj_cs_get_axis_info(context, axes.get(), is_compound ? 0 : kHeight, nullptr, nullptr, &direction, &metres,
                            &unit, nullptr, nullptr) == 0) {
    return;
  }
  description_.vertical_name = is_compound ? one_line(or_empty(proj_get_name(vertical.get()))) : kAboveEllipsoid;
  description_.vertical_unit = or_empty(unit);
  description_.metres_per_vertical_unit = exact(metres) * (std::string_view(direction) == "down" ? -1.0 : 1.0);
  const int code = is_compound ? proj::epsg_of(vertical.get()) : 0;
  if (code > 0) description_.vertical_epsg = code;
}

std::string Crs::wkt(WktDialect dialect) const {
  const std::lock_guard lock(mutex_);
  const std::string text = proj::wkt_of(context_.get(), whole_.get(),
                                        dialect == WktDialect::kWkt2   ? PJ_WKT2_2019
                                        : dialect == WktDialect::kGdal ? PJ_WKT1_GDAL
                                                                       : PJ_WKT1_ESRI);
  // Of a method of its own PROJ makes a name that nobody reads, in ESRI's dialect.
  const bool is_readable = dialect != WktDialect::kEsri || text.find("PROJECTION[\"PROJ_") == std::string::npos;
  return is_readable ? text : std::string();
}

std::optional<int> Crs::identified() const {
  if (description_.epsg || !description_.authority.empty()) return description_.epsg;
  // EPSG has systems of the Earth alone.
  if (std::abs(description_.ellipsoid.semi_major_axis_m / 6378137.0 - 1.0) > 0.01) return std::nullopt;
  const std::lock_guard lock(mutex_);
  if (!identified_) identified_ = find_code();
  return *identified_;
}

std::optional<int> Crs::find_code() const {
  int* confidence = nullptr;
  const std::unique_ptr<PJ_OBJ_LIST, proj::Destroy<proj_list_destroy>> found(
      proj_identify(context_.get(), horizontal_.get(), "EPSG", nullptr, &confidence));
  const std::unique_ptr<int, proj::Destroy<proj_int_list_destroy>> owner(confidence);
  // From here on PROJ found name, datum and all parameters alike.
  constexpr int kCertain = 90;
  if (!found || proj_list_get_count(found.get()) == 0 || confidence[0] < kCertain) return std::nullopt;
  const Object first(proj_list_get(context_.get(), found.get(), 0));
  const int code = first ? proj::epsg_of(first.get()) : 0;
  return code > 0 ? std::optional(code) : std::nullopt;
}

GeoPoint Crs::geo_from_map(MapPoint place) const {
  return to_geo_->geo_from_map({place.easting * scale_, place.northing * scale_});
}

MapPoint Crs::map_from_geo(GeoPoint place) const {
  const MapPoint at = to_geo_->map_from_geo(place);
  return {at.easting / scale_, at.northing / scale_};
}

bool Crs::may_be(const Crs& other) const {
  return is_same(other, !description_.is_datum_known || !other.description_.is_datum_known);
}

bool Crs::is_equivalent(const Crs& other) const {
  // Rasters have East before North, whatever the axes, and heights of their own.
  const proj::Context context = proj::make_context();
  const auto as_in_rasters = [&](const Crs& crs) {
    const std::lock_guard lock(crs.mutex_);
    const Object part(proj_clone(context.get(), crs.horizontal_.get()));
    const Object flat(part ? proj_crs_demote_to_2D(context.get(), nullptr, part.get()) : nullptr);
    return Object(flat ? proj_normalize_for_visualization(context.get(), flat.get()) : nullptr);
  };
  const Object ours = as_in_rasters(*this);
  const Object theirs = as_in_rasters(other);
  return ours && theirs &&
         proj_is_equivalent_to_with_ctx(context.get(), ours.get(), theirs.get(),
                                        PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS) != 0;
}

bool Crs::is_same(const Crs& other, bool any_datum) const {
  if (this == &other || is_equivalent(other)) return true;
  // PROJ does not hold one method's variants against each other (polar stereographic by its scale, or by a parallel).
  const Description& theirs = other.description_;
  constexpr double kSameUnit = 1e-12;
  if (description_.is_projected != theirs.is_projected || std::abs(description_.unit / theirs.unit - 1.0) > kSameUnit ||
      !are_alike(description_.ellipsoid, theirs.ellipsoid)) {
    return false;
  }
  // On other bodies an equal ellipsoid is the same datum, whatever its name.
  const bool is_earth = std::abs(description_.ellipsoid.semi_major_axis_m / Ellipsoid().semi_major_axis_m - 1.0) < 0.01;
  any_datum = any_datum || !is_earth;
  if (!any_datum && description_.datum != theirs.datum) return false;
  if (description_.is_projected) return has_same_places(other);
  return any_datum && description_.prime_meridian_deg == theirs.prime_meridian_deg;
}

bool Crs::has_same_places(const Crs& other) const {
  constexpr double kSameMetres = 1e-6;
  int compared = 0;
  for (double latitude = -80.0; latitude <= 80.0; latitude += 20.0) {
    for (double longitude = -170.0; longitude < 180.0; longitude += 20.0) {
      const MapPoint ours = to_geo_->map_from_geo({longitude, latitude});
      const MapPoint theirs = other.to_geo_->map_from_geo({longitude, latitude});
      if (std::isnan(ours.easting) != std::isnan(theirs.easting)) return false;
      if (std::isnan(ours.easting)) continue;
      const double apart = std::hypot(ours.easting - theirs.easting, ours.northing - theirs.northing);
      if (!(apart * description_.unit <= kSameMetres)) return false;
      ++compared;
    }
  }
  return compared > 4;
}

std::shared_ptr<const Crs> Crs::parse(const std::string& text, std::optional<double> metres_per_unit,
                                      std::optional<int> vertical_epsg) {
  // The files of a mosaic name one system thousands of times, or theirs and the user's in turn.
  static std::mutex mutex;
  static std::array<std::pair<std::string, std::shared_ptr<const Crs>>, 4> known;
  const std::string asked = fmt::format("{} {} {}", metres_per_unit.value_or(0.0), vertical_epsg.value_or(0), text);
  const std::lock_guard lock(mutex);
  auto* found = std::ranges::find(known, asked, [](const auto& each) -> const std::string& { return each.first; });
  if (found == known.end()) {
    found = known.end() - 1;
    *found = {asked, std::shared_ptr<const Crs>(new Crs(text, metres_per_unit, vertical_epsg))};
  }
  std::rotate(known.begin(), found, found + 1);
  return known.front().second;
}

std::string system_text(const ReferenceSystem& system) {
  return system.epsg ? fmt::format("EPSG:{}", *system.epsg) : system.wkt;
}

std::string wkt_of(const ReferenceSystem& system, WktDialect dialect) {
  const std::string text = system_text(system);
  if (text.empty()) return {};
  try {
    const auto crs = Crs::parse(text, std::nullopt, system.vertical_epsg);
    for (const WktDialect each : {dialect, WktDialect::kGdal}) {
      if (std::string wkt = crs->wkt(each); !wkt.empty()) return wkt;
    }
    return crs->wkt(WktDialect::kWkt2);
  } catch (const Error&) {
    return system.wkt;
  }
}

std::optional<bool> are_same(const ReferenceSystem& a, const ReferenceSystem& b) {
  if (a.epsg && b.epsg) return *a.epsg == *b.epsg;
  const std::string ours = system_text(a);
  const std::string theirs = system_text(b);
  if (ours.empty() || theirs.empty()) return std::nullopt;
  if (ours == theirs) return true;
  try {
    const auto first = Crs::parse(ours);
    return first->is_same(*Crs::parse(theirs));
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::shared_ptr<const ReferenceMap> understand_map(const std::string& text, std::optional<double> metres_per_unit) {
  if (auto utm = utm_map(text, metres_per_unit)) return utm;
  return Crs::parse(text, metres_per_unit);
}

}  // namespace isohf
