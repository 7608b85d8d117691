#include "isohf/projection/crs/crs_operation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/crs/crs.h"

namespace isohf {

using proj::Object;

/// What operations are looked for with: PROJ's objects, cloned for a context of their own.
class CrsParts {
 public:
  explicit CrsParts(const Crs& crs, PJ_CONTEXT* context) : context_(context), degrees_per_unit(crs.degrees_per_unit_) {
    const std::lock_guard lock(crs.mutex_);
    whole_.reset(proj_clone(context, crs.whole_.get()));
    horizontal.reset(proj_clone(context, crs.horizontal_.get()));
  }

  /// The system without heights, but with its binding to another datum.
  [[nodiscard]] Object with_datum() const {
    Object part(proj_clone(context_, whole_.get()));
    while (proj_get_type(part.get()) == PJ_TYPE_COMPOUND_CRS) {
      part.reset(proj_crs_get_sub_crs(context_, part.get(), 0));
    }
    return part;
  }

  /// Its longitudes and latitudes, bound to another datum where the system is.
  [[nodiscard]] Object geographic() const {
    const Object system = with_datum();
    if (proj_get_type(system.get()) != PJ_TYPE_BOUND_CRS) {
      return Object(proj_crs_get_geodetic_crs(context_, system.get()));
    }
    const Object base(proj_get_source_crs(context_, system.get()));
    const Object hub(proj_get_target_crs(context_, system.get()));
    const Object way(proj_crs_get_coordoperation(context_, system.get()));
    const Object geographic(base ? proj_crs_get_geodetic_crs(context_, base.get()) : nullptr);
    if (!geographic || !hub || !way) return nullptr;
    return Object(proj_crs_create_bound_crs(context_, geographic.get(), hub.get(), way.get()));
  }

 private:
  PJ_CONTEXT* context_;
  Object whole_;

 public:
  Object horizontal;
  double degrees_per_unit;
};

namespace {

[[noreturn]] void refuse_way(const std::string& name, const std::string& why) {
  throw Error(ErrorCode::kUnsupported, fmt::format("\"{}\" {}", name, why));
}

/// A reference system's coordinates, metres, and longitudes and latitudes on another datum.
class PipelineMap final : public ReferenceMap {
 public:
  PipelineMap(const PJ* pipeline, double metres_per_unit, const Ellipsoid& ellipsoid)
      : operation_(pipeline, ProjOperation::Runs::kFromGeo), metres_(metres_per_unit), ellipsoid_(ellipsoid) {
    operation_.find_outline();
  }

  [[nodiscard]] GeoPoint geo_from_map(MapPoint place) const override {
    return operation_.geo_from_map({place.easting / metres_, place.northing / metres_});
  }
  [[nodiscard]] MapPoint map_from_geo(GeoPoint place) const override {
    const MapPoint at = operation_.map_from_geo(place);
    return {at.easting * metres_, at.northing * metres_};
  }
  [[nodiscard]] double metres_per_unit() const override { return 1.0; }
  [[nodiscard]] const Ellipsoid& ellipsoid() const override { return ellipsoid_; }

 private:
  ProjOperation operation_;
  double metres_;
  Ellipsoid ellipsoid_;
};

/// What names the datum of a source's longitudes and latitudes: its system, else its ellipsoid, else WGS 84.
std::string datum_text(const ReferenceSystem& system, const std::optional<Ellipsoid>& ellipsoid = std::nullopt) {
  if (std::string text = system_text(system); !text.empty()) {
    // PROJ takes unknown datums of two ellipsoids for one, silently, where their meridians have one name.
    for (const std::string_view of_bodies : {"PRIMEM[\"Reference_Meridian\"", "PRIMEM[\"Reference meridian\""}) {
      const std::size_t at = text.find(of_bodies);
      if (at != std::string::npos) text.replace(at, of_bodies.size(), "PRIMEM[\"Greenwich\"");
    }
    return text;
  }
  if (!system.semi_major_axis_m && !ellipsoid) return "EPSG:4326";
  const double radius = system.semi_major_axis_m ? *system.semi_major_axis_m : ellipsoid->semi_major_axis_m;
  const double inverse =
      system.semi_major_axis_m ? system.inverse_flattening.value_or(0.0) : ellipsoid->inverse_flattening;
  return inverse > 0.0 ? fmt::format("+proj=longlat +a={} +rf={}", radius, inverse)
                       : fmt::format("+proj=longlat +R={}", radius);
}

/// Longitudes and latitudes as a system counts them.
struct Counted {
  double degrees_per_unit = 1.0;
  double prime_meridian_deg = 0.0;
};

constexpr int kTried = 9;

/// Of kTried of a ground, how many an operation from counted longitudes and latitudes has a place for: grids of shifts
/// end.
int places_shown(PJ_CONTEXT* context, const PJ* way, const Counted& counted, const GeoExtent& ground) {
  const Object operation(proj_normalize_for_visualization(context, way));
  const double width = ground.east - ground.west + (ground.east < ground.west ? 360.0 : 0.0);
  int shown = 0;
  for (int i = 0; operation && i < kTried; ++i) {
    const double longitude = ground.west + 0.5 * (i % 3) * width - counted.prime_meridian_deg;
    const double latitude = ground.south + 0.5 * (i / 3) * (ground.north - ground.south);
    const double unit = counted.degrees_per_unit;
    const PJ_COORD to =
        proj_trans(operation.get(), PJ_FWD, proj_coord(longitude / unit, latitude / unit, 0.0, HUGE_VAL));
    if (proj_errno(operation.get()) == 0 && std::isfinite(to.xy.x) && std::isfinite(to.xy.y)) ++shown;
    proj_errno_reset(operation.get());
  }
  return shown;
}

/// The operation that transforms most of a ground, PROJ's first before the next, ballpark ones only as a last resort;
/// null where PROJ knows none.
Object best_way(PJ_CONTEXT* context, const PJ* from, const PJ* to, const GeoExtent& ground, const Counted& counted) {
  const std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, proj::Destroy<proj_operation_factory_context_destroy>> factory(
      proj_create_operation_factory_context(context, nullptr));
  if (from == nullptr || to == nullptr || !factory) return nullptr;
  proj_operation_factory_context_set_spatial_criterion(context, factory.get(),
                                                       PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  proj_operation_factory_context_set_grid_availability_use(context, factory.get(),
                                                           PROJ_GRID_AVAILABILITY_DISCARD_OPERATION_IF_MISSING_GRID);
  // Ground beyond a datum's area of use is better moved by what holds there than not at all.
  Object best;
  int most = -1;
  for (const bool anywhere : {false, true}) {
    if (anywhere && most > 0 && proj_coordoperation_has_ballpark_transformation(context, best.get()) == 0) break;
    const GeoExtent area = anywhere ? GeoExtent{-180.0, -90.0, 180.0, 90.0} : ground;
    proj_operation_factory_context_set_area_of_interest(context, factory.get(), area.west, area.south, area.east,
                                                        area.north);
    const std::unique_ptr<PJ_OBJ_LIST, proj::Destroy<proj_list_destroy>> ways(
        proj_create_operations(context, from, to, factory.get()));
    const int count = ways ? proj_list_get_count(ways.get()) : 0;
    for (int i = 0; i < count; ++i) {
      Object way(proj_list_get(context, ways.get(), i));
      // One that takes the datums for one serves where no other shows anything.
      const bool is_ballpark = proj_coordoperation_has_ballpark_transformation(context, way.get()) != 0;
      const int shown = places_shown(context, way.get(), counted, ground);
      const int worth = is_ballpark ? std::min(shown, 1) : 2 * shown;
      if (worth <= most) continue;
      most = worth;
      best = std::move(way);
      if (most == 2 * kTried) return best;
    }
  }
  return best;
}

/// Longitudes and latitudes in degrees from Greenwich first become what a system counts.
std::string counting(std::string pipeline, const Counted& counted) {
  const double unit = counted.degrees_per_unit;
  const double meridian_deg = counted.prime_meridian_deg;
  if (std::abs(unit - 1.0) <= 1e-12 && std::abs(meridian_deg) <= 1e-12) return pipeline;
  constexpr std::string_view kHead = "+proj=pipeline";
  const std::string rest = pipeline.starts_with(kHead) ? pipeline.substr(kHead.size()) : " +step " + pipeline;
  return fmt::format("+proj=pipeline +step +proj=affine +xoff={} +s11={} +s22={}{}", -meridian_deg / unit, 1.0 / unit,
                     1.0 / unit, rest);
}

struct Operation {
  std::string pipeline;
  bool is_ballpark = false;
};

Operation find_operation(const Crs& from, const Crs& to, const GeoExtent& ground, const std::string& name) {
  const proj::Context context = proj::make_context();
  const CrsParts source(from, context.get());
  const CrsParts target(to, context.get());
  const Object there = target.with_datum();
  Counted counted{source.degrees_per_unit, from.description().prime_meridian_deg};
  Object first = best_way(context.get(), source.geographic().get(), there.get(), ground, counted);
  Operation found;
  found.is_ballpark = !first || proj_coordoperation_has_ballpark_transformation(context.get(), first.get()) != 0;
  // PROJ goes to no other body, and knows none by a radius. Bodies whose radii are as alike as these are one.
  constexpr double kSameBody = 0.01;
  const Ellipsoid& ours = from.ellipsoid();
  const Ellipsoid& theirs = to.ellipsoid();
  const double apart = std::abs(ours.semi_major_axis_m / theirs.semi_major_axis_m - 1.0);
  if (!first && apart < kSameBody) {
    counted = {target.degrees_per_unit, to.description().prime_meridian_deg};
    first = best_way(context.get(), target.geographic().get(), there.get(), ground, counted);
  }
  // On other bodies an ellipsoid says what datum there is.
  const bool is_earth = std::abs(ours.semi_major_axis_m / Ellipsoid().semi_major_axis_m - 1.0) < kSameBody;
  if (!is_earth && apart < 1e-9 && std::abs(ours.inverse_flattening - theirs.inverse_flattening) < 1e-6) {
    found.is_ballpark = false;
  }
  const Object way(first ? proj_normalize_for_visualization(context.get(), first.get()) : nullptr);
  const char* const text = way ? proj_as_proj_string(context.get(), way.get(), PJ_PROJ_5, nullptr) : nullptr;
  if (text == nullptr) refuse_way(name, "cannot be reached from the input's reference system: PROJ knows no way");
  found.pipeline = counting(text, counted);
  return found;
}

/// Heights are moved by nobody: a system that speaks of others is not what the raster would be in.
void require_same_heights(const ReferenceSystem& from, const Crs::Description& target, const std::string& name) {
  if (target.vertical_name.empty() || target.vertical_name == from.vertical_datum) return;
  if (target.vertical_epsg && target.vertical_epsg == from.vertical_epsg) return;
  throw Error(ErrorCode::kInvalidArgument,
              fmt::format("\"{}\" speaks of heights, \"{}\", and the input's stay what they are; name the system "
                          "without its heights",
                          name, target.vertical_name));
}

}  // namespace

SystemOnBody on_body_of(const ReferenceSystem& raster, const Ellipsoid& ellipsoid, const std::string& text) {
  constexpr double kSameBody = 0.01;  // of radii
  const auto understood = Crs::parse(text);
  const Crs::Description& map = understood->description();
  const auto is_near = [](double radius, double other) { return std::abs(radius / other - 1.0) < kSameBody; };
  if (is_near(map.ellipsoid.semi_major_axis_m, ellipsoid.semi_major_axis_m)) return {text};
  const auto name_of = [](const std::string& name, double radius) {
    return name.empty() ? fmt::format("a body of radius {:.8g} m", radius) : name;
  };
  const std::string body = name_of(raster.body.empty() ? body_of("", ellipsoid.semi_major_axis_m) : raster.body,
                                   ellipsoid.semi_major_axis_m);
  // UTM zones are the Earth's.
  bool states_body = !is_near(map.ellipsoid.semi_major_axis_m, Ellipsoid().semi_major_axis_m) ||
                     map.authority.starts_with("IAU") || map.name.find("UTM zone") != std::string::npos;
  for (const char* parameter : {"+R=", "+a=", "+b=", "+rf=", "+ellps=", "+datum="})
    states_body = states_body || text.find(parameter) != std::string::npos;
  const std::string name = shown_name(map.name, text);
  if (!map.is_projected || states_body) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("\"{}\" is of {}, the input of {}; name a map of that body, or a projection without a body "
                            "(ESRI:54009, +proj=moll)",
                            name,
                            name_of(body_of(map.name + ' ' + map.datum, map.ellipsoid.semi_major_axis_m),
                                    map.ellipsoid.semi_major_axis_m),
                            body));
  }
  const proj::Context context = proj::make_context();
  const CrsParts target(*understood, context.get());
  const CrsParts ground(*Crs::parse(datum_text(raster, ellipsoid)), context.get());
  const Object geographic(proj_crs_get_geodetic_crs(context.get(), ground.horizontal.get()));
  const Object moved(geographic ? proj_crs_alter_geodetic_crs(context.get(), target.horizontal.get(), geographic.get())
                                : nullptr);
  const Object named(moved ? proj_alter_name(context.get(), moved.get(), fmt::format("{} on {}", name, body).c_str())
                           : nullptr);
  const std::string wkt = named ? proj::wkt_of(context.get(), named.get(), PJ_WKT2_2019) : std::string();
  if (wkt.empty()) refuse_way(name, "cannot be moved to another body by PROJ");
  return {wkt, body};
}

WayToSystem find_way(const ReferenceSystem& from, const std::string& to, const GeoExtent& ground,
                     const Ellipsoid& ellipsoid) {
  const auto understood = Crs::parse(to);
  const Crs::Description& target = understood->description();
  const std::string name = shown_name(target.name, to);
  require_same_heights(from, target, name);
  Operation operation = find_operation(*Crs::parse(datum_text(from)), *understood, ground, name);
  WayToSystem way;
  way.system = {target.epsg ? fmt::format("EPSG:{}", *target.epsg) : understood->wkt(WktDialect::kWkt2), name,
                std::move(operation.pipeline), target.is_projected ? target.unit : 1.0};
  way.is_projected = target.is_projected;
  MappedSystem in_units = way.system;
  in_units.metres_per_unit = 1.0;
  way.map = understand_way(in_units, ellipsoid);
  way.is_ballpark = operation.is_ballpark;
  return way;
}

std::string ballpark_note(const std::string& from, const WayToSystem& way) {
  return fmt::format(
      "PROJ knows no way from {} to that of \"{}\": they are taken for one, which may be off by some hundred metres",
      from, way.system.name);
}

std::shared_ptr<const ReferenceMap> understand_way(const MappedSystem& system, const Ellipsoid& ellipsoid) {
  const proj::Context context = proj::make_context();
  const Object pipeline(proj_create(context.get(), system.operation.c_str()));
  if (!pipeline) {
    const int code = proj_context_errno(context.get());
    throw Error(ErrorCode::kUnsupported, fmt::format("the way to the map {}: PROJ does not understand it: {}",
                                                     system.name.empty() ? system.text : system.name,
                                                     proj_context_errno_string(context.get(), code)));
  }
  return std::make_shared<PipelineMap>(pipeline.get(), system.metres_per_unit, ellipsoid);
}

}  // namespace isohf
