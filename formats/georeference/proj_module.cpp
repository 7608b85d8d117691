#include "formats/georeference/proj_module.h"

#include <proj.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
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
  Object system;      ///< all of it
  Object horizontal;  ///< its horizontal part
  Object to_geo;      ///< horizontal -> its own longitudes and latitudes, East before North
  std::string wkt;
  double degrees_per_unit = 1.0;  ///< of those longitudes and latitudes
  double prime_meridian_deg = 0.0;
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
  system.prime_meridian_deg = longitude * radians * kDegreesPerRadian;
  system.degrees_per_unit = unit_of(context, geographic.get()) * kDegreesPerRadian;

  const Object operation(proj_create_crs_to_crs_from_pj(context, part, geographic.get(), nullptr, nullptr));
  if (operation) system.to_geo.reset(proj_normalize_for_visualization(context, operation.get()));
  if (!system.to_geo) refuse("has no way to longitudes and latitudes that PROJ knows");

  const char* const one_line[] = {"MULTILINE=NO", nullptr};
  const char* const wkt = proj_as_wkt(context, system.system.get(), PJ_WKT2_2019, one_line);
  system.wkt = wkt != nullptr ? wkt : "";
  info.wkt_bytes = system.wkt.size() + 1;
}

void open(const std::string& text, IsohfProjSystem& system, IsohfProjInfo& info) {
  system.context = make_context();
  PJ_CONTEXT* const context = system.context.get();
  system.system.reset(proj_create(context, as_system(text).c_str()));
  if (!system.system) {
    if (proj_context_get_database_path(context) == nullptr) {
      refuse("PROJ finds no proj.db (Debian package proj-data; the environment variable PROJ_DATA names its folder)");
    }
    const char* const why = proj_context_errno_string(context, proj_context_errno(context));
    refuse(std::string("PROJ does not understand it") +
           (proj_context_errno(context) != 0 && why != nullptr ? std::string(": ") + why : ""));
  }
  system.horizontal = horizontal_part(context, system.system.get());
  describe(system, info);
}

int module_open(const char* text, IsohfProjSystem** system, IsohfProjInfo* info, IsohfProjMessage* message) {
  return isohf::guarded(message, "PROJ", ErrorCode::kUnsupported, [&] {
    auto made = std::make_unique<IsohfProjSystem>();
    open(text, *made, *info);
    *system = made.release();
  });
}

void module_wkt(const IsohfProjSystem* system, char* wkt) {
  std::memcpy(wkt, system->wkt.c_str(), system->wkt.size() + 1);
}

/// NaN where PROJ found no place: it says infinity, or leaves an error.
void move(const IsohfProjSystem& system, PJ_DIRECTION direction, double* places, std::size_t count) {
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  Worker worker = system.take();
  for (std::size_t i = 0; i < count; ++i) {
    double* const at = places + 2 * i;
    PJ_COORD from = proj_coord(at[0], at[1], 0.0, HUGE_VAL);
    if (direction == PJ_INV) {
      from.xy.x = std::remainder(at[0] - system.prime_meridian_deg, 360.0) / system.degrees_per_unit;
      from.xy.y = at[1] / system.degrees_per_unit;
    }
    PJ_COORD to = proj_coord(kNowhere, kNowhere, 0.0, 0.0);
    if (worker.operation && std::isfinite(from.xy.x) && std::isfinite(from.xy.y)) {
      to = proj_trans(worker.operation.get(), direction, from);
      if (proj_errno(worker.operation.get()) != 0) {
        proj_errno_reset(worker.operation.get());
        to = proj_coord(kNowhere, kNowhere, 0.0, 0.0);
      }
    }
    const bool is_place = std::isfinite(to.xy.x) && std::isfinite(to.xy.y);
    at[0] = is_place ? to.xy.x : kNowhere;
    at[1] = is_place ? to.xy.y : kNowhere;
    if (direction == PJ_INV) continue;
    at[0] = std::remainder(at[0] * system.degrees_per_unit + system.prime_meridian_deg, 360.0);
    at[1] *= system.degrees_per_unit;
  }
  system.give_back(std::move(worker));
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
  static const IsohfProjModule module = {ISOHF_PROJ_ABI,  module_open,  module_wkt,    module_to_geo,
                                         module_from_geo, module_close, module_library};
  return &module;
}
