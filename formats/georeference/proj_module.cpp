#include "formats/georeference/proj_module.h"

#include <proj.h>
#include <proj_experimental.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "formats/module_inside.h"
#include "isohf/error.h"

// The module is a library of its own: it shares headers with isohf, no code.
namespace {

using isohf::Error;
using isohf::ErrorCode;

constexpr double kDegreesPerRadian = 180.0 / M_PI;

template <auto kFunction>
struct Destroy {
  template <typename T>
  void operator()(T* object) const {
    kFunction(object);
  }
};
using Context = std::unique_ptr<PJ_CONTEXT, Destroy<proj_context_destroy>>;
using Object = std::unique_ptr<PJ, Destroy<proj_destroy>>;

/// An operation with a context of its own: PROJ's are for one thread at a time.
struct Worker {
  Context context;
  Object operation;
};

Context make_context() {
  Context context(proj_context_create());
  if (!context) throw Error(ErrorCode::kOutOfMemory, "PROJ has no memory for a context");
  proj_context_set_enable_network(context.get(), 0);
  // Else it goes to standard error, whatever the level.
  proj_log_func(context.get(), nullptr, [](void*, int, const char*) {});
  return context;
}

}  // namespace

struct IsohfProjSystem {
  Context context;
  Object system;             ///< all of it
  Object horizontal;         ///< its horizontal part
  Object to_geo;             ///< horizontal -> its own longitudes and latitudes, East before North
  bool is_pipeline = false;  ///< to_geo runs from degrees to coordinates, and nothing else is there
  std::string wkt[ISOHF_WKTS];
  double degrees_per_unit = 1.0;  ///< of those longitudes and latitudes
  double prime_meridian_deg = 0.0;
  /// How far, in its units, what is there and back may lie apart; 0: nothing is shown twice. Beyond the outline of maps
  /// like the sinusoidal one the way back goes round the body again.
  double most_apart = 0.0;
  mutable std::mutex mutex;
  mutable std::vector<Worker> idle;

  [[nodiscard]] Worker take() const {
    {
      const std::lock_guard lock(mutex);
      if (!idle.empty()) {
        Worker worker = std::move(idle.back());
        idle.pop_back();
        return worker;
      }
    }
    Worker worker{make_context(), nullptr};
    // Cloning looks at the original.
    const std::lock_guard lock(mutex);
    worker.operation.reset(proj_clone(worker.context.get(), to_geo.get()));
    return worker;
  }

  void give_back(Worker worker) const {
    const std::lock_guard lock(mutex);
    idle.push_back(std::move(worker));
  }
};

namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kUnsupported, why);
}

/// With PROJ's reason, where it has one.
[[noreturn]] void refuse_text(PJ_CONTEXT* context) {
  const int code = proj_context_errno(context);
  const char* const why = code != 0 && code != PROJ_ERR_OTHER ? proj_context_errno_string(context, code) : nullptr;
  refuse(std::string("PROJ does not understand it") + (why != nullptr ? std::string(": ") + why : ""));
}

/// PROJ takes its own strings for operations unless they say that they are systems.
std::string as_system(const std::string& text) {
  const bool is_string = text.find("+proj=") != std::string::npos || text.find("+init=") != std::string::npos;
  return is_string && text.find("+type=crs") == std::string::npos ? text + " +type=crs" : text;
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
        if (proj_is_derived_crs(context, part.get()) != 0) {
          refuse(
              "counts degrees about a rotated pole; gdalwarp -t_srs EPSG:4326 makes longitudes and latitudes of them");
        }
        return part;
      case PJ_TYPE_PROJECTED_CRS:
        return part;
      default:
        refuse(std::string("is no projected or geographic reference system, but \"") +
               (part && proj_get_name(part.get()) != nullptr ? proj_get_name(part.get()) : "") + "\"");
    }
  }
}

/// The unit of both axes, in metres or radians. Refuses axes that nothing in a north-up raster lies along.
double unit_of(PJ_CONTEXT* context, const PJ* system) {
  const Object axes(proj_crs_get_coordinate_system(context, system));
  double unit[2] = {0.0, 0.0};
  for (int axis = 0; axis < 2; ++axis) {
    const char* direction = nullptr;
    if (!axes || proj_cs_get_axis_info(context, axes.get(), axis, nullptr, nullptr, &direction, &unit[axis], nullptr,
                                       nullptr, nullptr) == 0) {
      refuse("has axes that PROJ does not tell");
    }
    // At a pole both axes of a map run the same way.
    if (std::string(direction) == "west") refuse("has an axis that runs westwards");
  }
  if (unit[0] != unit[1] || !(unit[0] > 0.0)) refuse("has axes of different units");
  return unit[0];
}

/// Of a compound system its second part; else the third axis, which counts from the ellipsoid.
void describe_heights(PJ_CONTEXT* context, const PJ* system, const PJ* horizontal, IsohfProjInfo& info) {
  const bool is_compound = proj_get_type(system) == PJ_TYPE_COMPOUND_CRS;
  const Object vertical(is_compound ? proj_crs_get_sub_crs(context, system, 1) : proj_clone(context, horizontal));
  const Object axes(vertical ? proj_crs_get_coordinate_system(context, vertical.get()) : nullptr);
  constexpr int kHeight = 2;
  if (!is_compound && (!axes || proj_cs_get_axis_count(context, axes.get()) <= kHeight)) return;
  const char* direction = nullptr;
  const char* unit = nullptr;
  if (!axes || proj_cs_get_axis_info(context, axes.get(), is_compound ? 0 : kHeight, nullptr, nullptr, &direction,
                                     &info.metres_per_vertical_unit, &unit, nullptr, nullptr) == 0) {
    return;
  }
  isohf::put_text(info.vertical_name, is_compound ? proj_get_name(vertical.get()) : ISOHF_ELLIPSOIDAL_HEIGHT);
  isohf::put_text(info.vertical_unit, unit);
  if (std::string(direction) == "down") info.metres_per_vertical_unit *= -1.0;
  if (!is_compound) return;
  const char* const authority = proj_get_id_auth_name(vertical.get(), 0);
  if (authority != nullptr && std::string(authority) == "EPSG") {
    info.vertical_epsg = std::atoi(proj_get_id_code(vertical.get(), 0));
  }
}

void describe(IsohfProjSystem& system, IsohfProjInfo& info) {
  PJ_CONTEXT* const context = system.context.get();
  const PJ* const part = system.horizontal.get();
  info.is_projected = proj_get_type(part) == PJ_TYPE_PROJECTED_CRS ? 1 : 0;
  info.is_compound = proj_get_type(system.system.get()) == PJ_TYPE_COMPOUND_CRS ? 1 : 0;
  isohf::put_text(info.name, proj_get_name(part));
  isohf::put_text(info.authority, proj_get_id_auth_name(part, 0));
  isohf::put_text(info.code, proj_get_id_code(part, 0));
  const double unit = unit_of(context, part);
  info.metres_per_unit = info.is_projected != 0 ? unit : unit * kDegreesPerRadian;

  const Object geographic(proj_crs_get_geodetic_crs(context, part));
  const Object ellipsoid(proj_get_ellipsoid(context, part));
  if (!geographic || !ellipsoid) refuse("names no ellipsoid");
  Object datum(proj_crs_get_datum(context, geographic.get()));
  if (!datum) datum.reset(proj_crs_get_datum_ensemble(context, geographic.get()));
  isohf::put_text(info.datum, datum ? proj_get_name(datum.get()) : proj_get_name(geographic.get()));
  double minor = 0.0;
  int is_minor_computed = 0;
  proj_ellipsoid_get_parameters(context, ellipsoid.get(), &info.semi_major_axis_m, &minor, &is_minor_computed,
                                &info.inverse_flattening);
  if (!(info.semi_major_axis_m > 0.0)) refuse("names no ellipsoid");

  const Object meridian(proj_get_prime_meridian(context, geographic.get()));
  double longitude = 0.0;
  double radians = 0.0;
  if (meridian) proj_prime_meridian_get_parameters(context, meridian.get(), &longitude, &radians, nullptr);
  info.prime_meridian_deg = system.prime_meridian_deg = longitude * radians * kDegreesPerRadian;
  system.degrees_per_unit = unit_of(context, geographic.get()) * kDegreesPerRadian;

  const Object operation(proj_create_crs_to_crs_from_pj(context, part, geographic.get(), nullptr, nullptr));
  if (operation) system.to_geo.reset(proj_normalize_for_visualization(context, operation.get()));
  if (!system.to_geo) refuse("has no way to longitudes and latitudes that PROJ knows");

  describe_heights(context, system.system.get(), part, info);
  const char* const one_line[] = {"MULTILINE=NO", nullptr};
  constexpr PJ_WKT_TYPE kDialects[ISOHF_WKTS] = {PJ_WKT2_2019, PJ_WKT1_GDAL, PJ_WKT1_ESRI};
  for (int dialect = 0; dialect < ISOHF_WKTS; ++dialect) {
    const char* const wkt = proj_as_wkt(context, system.system.get(), kDialects[dialect], one_line);
    system.wkt[dialect] = wkt != nullptr ? wkt : "";
    // Of a method of its own PROJ makes a name that nobody reads, in ESRI's dialect.
    if (dialect == ISOHF_WKT_ESRI && system.wkt[dialect].find("PROJECTION[\"PROJ_") != std::string::npos)
      system.wkt[dialect].clear();
    info.wkt_bytes[dialect] = system.wkt[dialect].size() + 1;
  }
}

/// PROJ takes any word for the first name in which it finds it: "foo" for "Amersfoort".
void check_name(const std::string& text, const char* found) {
  if (text.find_first_of(":[{+=") != std::string::npos) return;
  const auto letters = [](std::string_view name) {
    std::string kept;
    for (const char c : name) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0)
        kept += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return kept;
  };
  if (found != nullptr && letters(text) == letters(found)) return;
  refuse("it is the name of none" +
         (found != nullptr ? std::string(": \"") + found + "\" is the nearest" : std::string()) +
         "; EPSG:2154, WKT, a PROJ string or a whole name is wanted");
}

void open(const std::string& text, const char* heights, IsohfProjSystem& system, IsohfProjInfo& info) {
  system.context = make_context();
  PJ_CONTEXT* const context = system.context.get();
  system.system.reset(proj_create(context, as_system(text).c_str()));
  if (!system.system) {
    if (proj_context_get_database_path(context) == nullptr) {
      refuse("PROJ finds no proj.db (Debian package proj-data; the environment variable PROJ_DATA names its folder)");
    }
    refuse_text(context);
  }
  check_name(text, proj_get_name(system.system.get()));
  system.horizontal = horizontal_part(context, system.system.get());
  if (*heights != '\0' && proj_get_type(system.system.get()) != PJ_TYPE_COMPOUND_CRS) {
    const Object vertical(proj_create(context, heights));
    const std::string name =
        vertical ? std::string(proj_get_name(system.horizontal.get())) + " + " + proj_get_name(vertical.get())
                 : std::string();
    Object both(vertical ? proj_create_compound_crs(context, name.c_str(), system.horizontal.get(), vertical.get())
                         : nullptr);
    if (both) system.system = std::move(both);
  }
  describe(system, info);
}

/// The system without heights, but with its binding to another datum: what operations are looked for with.
Object with_datum(PJ_CONTEXT* context, const PJ* system) {
  if (proj_get_type(system) == PJ_TYPE_COMPOUND_CRS) {
    const Object part(proj_crs_get_sub_crs(context, system, 0));
    return with_datum(context, part.get());
  }
  return Object(proj_clone(context, system));
}

/// The longitudes and latitudes of a system, bound to another datum where the system is.
Object geographic_part(PJ_CONTEXT* context, const PJ* system) {
  if (proj_get_type(system) != PJ_TYPE_BOUND_CRS) return Object(proj_crs_get_geodetic_crs(context, system));
  const Object base(proj_get_source_crs(context, system));
  const Object hub(proj_get_target_crs(context, system));
  const Object way(proj_crs_get_coordoperation(context, system));
  const Object geographic(base ? proj_crs_get_geodetic_crs(context, base.get()) : nullptr);
  if (!geographic || !hub || !way) return nullptr;
  return Object(proj_crs_create_bound_crs(context, geographic.get(), hub.get(), way.get()));
}

constexpr int kPlaces = 9;

/// Of kPlaces of a ground (West, South, East, North), how many a way from the longitudes and latitudes of a system has
/// a place for: grids of shifts end.
int places_shown(PJ_CONTEXT* context, const PJ* way, const IsohfProjSystem& counted, const double* ground) {
  const Object operation(proj_normalize_for_visualization(context, way));
  const double width = ground[2] - ground[0] + (ground[2] < ground[0] ? 360.0 : 0.0);
  int shown = 0;
  for (int i = 0; operation && i < kPlaces; ++i) {
    const double longitude = ground[0] + 0.5 * (i % 3) * width - counted.prime_meridian_deg;
    const double latitude = ground[1] + 0.5 * (i / 3) * (ground[3] - ground[1]);
    const double unit = counted.degrees_per_unit;
    const PJ_COORD to =
        proj_trans(operation.get(), PJ_FWD, proj_coord(longitude / unit, latitude / unit, 0.0, HUGE_VAL));
    if (proj_errno(operation.get()) == 0 && std::isfinite(to.xy.x) && std::isfinite(to.xy.y)) ++shown;
    proj_errno_reset(operation.get());
  }
  return shown;
}

/// Of PROJ's ways over a ground that which shows most of it, one that moves between the datums before any other, and
/// PROJ's first before the next; null where it knows none.
Object best_way(PJ_CONTEXT* context, const PJ* from, const PJ* to, const double* ground,
                const IsohfProjSystem& counted) {
  const std::unique_ptr<PJ_OPERATION_FACTORY_CONTEXT, Destroy<proj_operation_factory_context_destroy>> factory(
      proj_create_operation_factory_context(context, nullptr));
  if (from == nullptr || to == nullptr || !factory) refuse("has no longitudes and latitudes that PROJ knows");
  proj_operation_factory_context_set_spatial_criterion(context, factory.get(),
                                                       PROJ_SPATIAL_CRITERION_PARTIAL_INTERSECTION);
  proj_operation_factory_context_set_grid_availability_use(context, factory.get(),
                                                           PROJ_GRID_AVAILABILITY_DISCARD_OPERATION_IF_MISSING_GRID);
  // Ground beyond a datum's area of use is better moved by what holds there than not at all.
  Object best;
  int most = -1;
  for (const bool anywhere : {false, true}) {
    if (anywhere && most > 0 && proj_coordoperation_has_ballpark_transformation(context, best.get()) == 0) break;
    anywhere ? proj_operation_factory_context_set_area_of_interest(context, factory.get(), -180.0, -90.0, 180.0, 90.0)
             : proj_operation_factory_context_set_area_of_interest(context, factory.get(), ground[0], ground[1],
                                                                   ground[2], ground[3]);
    const std::unique_ptr<PJ_OBJ_LIST, Destroy<proj_list_destroy>> ways(
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
      if (most == 2 * kPlaces) return best;
    }
  }
  return best;
}

void find_operation(const char* from, const char* to, const double* ground, IsohfProjOperation& found) {
  IsohfProjSystem source;
  IsohfProjSystem target;
  IsohfProjInfo ours{};
  IsohfProjInfo theirs{};
  open(from, "", source, ours);
  open(to, "", target, theirs);
  PJ_CONTEXT* const context = target.context.get();
  const Object there = with_datum(context, target.system.get());
  const Object here = geographic_part(context, with_datum(context, source.system.get()).get());
  Object first = best_way(context, here.get(), there.get(), ground, source);
  const IsohfProjSystem* counted = &source;  // whose longitudes and latitudes the way begins with
  found.is_ballpark = first ? proj_coordoperation_has_ballpark_transformation(context, first.get()) : 1;
  // PROJ goes to no other body, and knows none by a radius. Bodies whose radii are as alike as these are one.
  constexpr double kSameBody = 0.01;
  const double apart = std::abs(ours.semi_major_axis_m / theirs.semi_major_axis_m - 1.0);
  if (!first && apart < kSameBody) {
    counted = &target;
    first = best_way(context, geographic_part(context, there.get()).get(), there.get(), ground, target);
  }
  // On other bodies an ellipsoid says what datum there is.
  const bool is_earth = std::abs(ours.semi_major_axis_m / 6378137.0 - 1.0) < kSameBody;
  if (!is_earth && apart < 1e-9 && std::abs(ours.inverse_flattening - theirs.inverse_flattening) < 1e-6) {
    found.is_ballpark = 0;
  }
  const Object way(first ? proj_normalize_for_visualization(context, first.get()) : nullptr);
  const char* const text = way ? proj_as_proj_string(context, way.get(), PJ_PROJ_5, nullptr) : nullptr;
  if (text == nullptr) refuse("cannot be reached from the input's reference system: PROJ knows no way");
  std::string pipeline = text;
  // Degrees from Greenwich first become what that system counts.
  const double unit = counted->degrees_per_unit;
  const double meridian_deg = counted->prime_meridian_deg;
  if (std::abs(unit - 1.0) > 1e-12 || std::abs(meridian_deg) > 1e-12) {
    constexpr std::string_view kHead = "+proj=pipeline";
    char head[256];
    std::snprintf(head, sizeof(head), "+proj=pipeline +step +proj=affine +xoff=%.17g +s11=%.17g +s22=%.17g",
                  -meridian_deg / unit, 1.0 / unit, 1.0 / unit);
    pipeline = head + (pipeline.starts_with(kHead) ? pipeline.substr(kHead.size()) : " +step " + pipeline);
  }
  if (pipeline.size() >= sizeof(found.pipeline)) refuse("needs an operation that is too long");
  isohf::put_text(found.pipeline, pipeline);
}

void put_on_body(const char* map, const char* body, const char* name, IsohfProjText& wkt) {
  IsohfProjSystem source;
  IsohfProjSystem target;
  IsohfProjInfo info{};
  open(body, "", source, info);
  open(map, "", target, info);
  PJ_CONTEXT* const context = target.context.get();
  const Object geographic(proj_crs_get_geodetic_crs(context, source.horizontal.get()));
  const Object moved(geographic ? proj_crs_alter_geodetic_crs(context, target.horizontal.get(), geographic.get())
                                : nullptr);
  const Object named(moved ? proj_alter_name(context, moved.get(), name) : nullptr);
  const char* const one_line[] = {"MULTILINE=NO", nullptr};
  const char* const text = named ? proj_as_wkt(context, named.get(), PJ_WKT2_2019, one_line) : nullptr;
  if (text == nullptr || std::strlen(text) >= sizeof(wkt.text)) refuse("cannot be moved to another body by PROJ");
  isohf::put_text(wkt.text, text);
}

void open_pipeline(const char* pipeline, IsohfProjSystem& system) {
  system.context = make_context();
  system.is_pipeline = true;
  system.to_geo.reset(proj_create(system.context.get(), pipeline));
  if (system.to_geo) return;
  refuse_text(system.context.get());
}

void find_outline(IsohfProjSystem& system);

int module_find_operation(const char* from, const char* to, const double* ground, IsohfProjOperation* operation,
                          IsohfProjMessage* message) {
  return isohf::guarded(message, "PROJ", ErrorCode::kUnsupported,
                        [&] { find_operation(from, to, ground, *operation); });
}

int module_on_body(const char* map, const char* body, const char* name, IsohfProjText* wkt, IsohfProjMessage* message) {
  return isohf::guarded(message, "PROJ", ErrorCode::kUnsupported, [&] { put_on_body(map, body, name, *wkt); });
}

int module_open_pipeline(const char* pipeline, IsohfProjSystem** system, IsohfProjMessage* message) {
  return isohf::guarded(message, "PROJ", ErrorCode::kUnsupported, [&] {
    auto made = std::make_unique<IsohfProjSystem>();
    open_pipeline(pipeline, *made);
    find_outline(*made);
    *system = made.release();
  });
}

int module_open(const char* text, const char* vertical, IsohfProjSystem** system, IsohfProjInfo* info,
                IsohfProjMessage* message) {
  return isohf::guarded(message, "PROJ", ErrorCode::kUnsupported, [&] {
    auto made = std::make_unique<IsohfProjSystem>();
    open(text, vertical, *made, *info);
    if (info->is_projected != 0) find_outline(*made);
    *system = made.release();
  });
}

void module_wkt(const IsohfProjSystem* system, int dialect, char* wkt) {
  std::memcpy(wkt, system->wkt[dialect].c_str(), system->wkt[dialect].size() + 1);
}

int module_same(const IsohfProjSystem* a, const IsohfProjSystem* b) {
  // Rasters have East before North, whatever the axes, and heights of their own.
  PJ_CONTEXT* const context = a->context.get();
  const auto as_in_rasters = [&](const Object& system) {
    const Object flat(proj_crs_demote_to_2D(context, nullptr, system.get()));
    return Object(flat ? proj_normalize_for_visualization(context, flat.get()) : nullptr);
  };
  const Object ours = as_in_rasters(a->horizontal);
  const Object theirs = as_in_rasters(b->horizontal);
  return ours && theirs ? proj_is_equivalent_to_with_ctx(context, ours.get(), theirs.get(),
                                                         PJ_COMP_EQUIVALENT_EXCEPT_AXIS_ORDER_GEOGCRS)
                        : 0;
}

/// NaN where PROJ found no place: it says infinity, or leaves an error.
void move(const IsohfProjSystem& system, PJ_DIRECTION direction, double* places, std::size_t count) {
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  Worker worker = system.take();
  const auto turned = [](PJ_DIRECTION way) { return way == PJ_FWD ? PJ_INV : PJ_FWD; };
  // A pipeline runs the other way.
  const PJ_DIRECTION along = system.is_pipeline ? turned(direction) : direction;
  const auto trans = [&worker](PJ_DIRECTION way, const PJ_COORD& from) {
    const PJ_COORD to = proj_trans(worker.operation.get(), way, from);
    if (proj_errno(worker.operation.get()) == 0) return to;
    proj_errno_reset(worker.operation.get());
    return proj_coord(kNowhere, kNowhere, 0.0, 0.0);
  };
  for (std::size_t i = 0; i < count; ++i) {
    double* const at = places + 2 * i;
    PJ_COORD from = proj_coord(at[0], at[1], 0.0, HUGE_VAL);
    if (direction == PJ_INV) {
      from.xy.x = std::remainder(at[0] - system.prime_meridian_deg, 360.0) / system.degrees_per_unit;
      from.xy.y = at[1] / system.degrees_per_unit;
    }
    PJ_COORD to = proj_coord(kNowhere, kNowhere, 0.0, 0.0);
    if (worker.operation && std::isfinite(from.xy.x) && std::isfinite(from.xy.y)) {
      to = trans(along, from);
    }
    bool is_place = std::isfinite(to.xy.x) && std::isfinite(to.xy.y);
    if (is_place && direction == PJ_FWD && system.most_apart > 0.0) {
      const PJ_COORD back = trans(turned(along), to);
      is_place = std::hypot(back.xy.x - from.xy.x, back.xy.y - from.xy.y) <= system.most_apart;
    }
    at[0] = is_place ? to.xy.x : kNowhere;
    at[1] = is_place ? to.xy.y : kNowhere;
    if (direction == PJ_INV) continue;
    at[0] = std::remainder(at[0] * system.degrees_per_unit + system.prime_meridian_deg, 360.0);
    at[1] *= system.degrees_per_unit;
  }
  system.give_back(std::move(worker));
}

/// Sets most_apart where corners of the box around the whole body's image are none of its places.
void find_outline(IsohfProjSystem& system) {
  constexpr int kAcross = 37;
  constexpr int kDown = 7;
  double at[2 * kAcross * kDown];
  for (int i = 0; i < kAcross * kDown; ++i) {
    at[2 * i] = -179.9 + (i % kAcross) * (359.8 / (kAcross - 1));
    at[2 * i + 1] = -85.0 + (i / kAcross) * (170.0 / (kDown - 1));
  }
  move(system, PJ_INV, at, kAcross * kDown);
  double box[4] = {HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (int i = 0; i < 2 * kAcross * kDown; ++i) {
    if (!std::isfinite(at[i])) continue;  // of both coordinates, or neither
    box[i % 2] = std::min(box[i % 2], at[i]);
    box[i % 2 + 2] = std::max(box[i % 2 + 2], at[i]);
  }
  const double size = std::max(box[2] - box[0], box[3] - box[1]);
  if (!(size > 0.0) || !std::isfinite(size)) return;
  constexpr double kMostApart = 1e-4;
  const double corners[8] = {box[0], box[1], box[2], box[1], box[0], box[3], box[2], box[3]};
  double back[8];
  std::copy(std::begin(corners), std::end(corners), back);
  move(system, PJ_FWD, back, 4);
  bool is_place[4];
  for (int i = 0; i < 4; ++i) is_place[i] = std::isfinite(back[2 * i]);
  move(system, PJ_INV, back, 4);
  for (int i = 0; i < 4; ++i) {
    const double apart = std::hypot(back[2 * i] - corners[2 * i], back[2 * i + 1] - corners[2 * i + 1]);
    if (is_place[i] && !(apart <= kMostApart * size)) system.most_apart = kMostApart * size;
  }
}

void module_to_geo(const IsohfProjSystem* system, double* places, size_t count) {
  move(*system, PJ_FWD, places, count);
}

void module_from_geo(const IsohfProjSystem* system, double* places, size_t count) {
  move(*system, PJ_INV, places, count);
}

void module_close(IsohfProjSystem* system) {
  delete system;
}

const char* module_library() {
  static const std::string text = std::string("PROJ ") + proj_info().version;
  return text.c_str();
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const IsohfProjModule* isohf_proj_module() {
  static const IsohfProjModule module = {ISOHF_PROJ_ABI,       module_open,  module_find_operation, module_on_body,
                                         module_open_pipeline, module_wkt,   module_same,           module_to_geo,
                                         module_from_geo,      module_close, module_library};
  return &module;
}
