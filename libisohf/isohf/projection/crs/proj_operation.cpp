#include "isohf/projection/crs/proj_operation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace isohf {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// NaN where PROJ finds no place: it says infinity, or leaves an error.
PJ_COORD moved(PJ* operation, PJ_DIRECTION direction, double x, double y) {
  PJ_COORD to = proj_trans(operation, direction, proj_coord(x, y, 0.0, HUGE_VAL));
  if (proj_errno(operation) == 0 && std::isfinite(to.xy.x) && std::isfinite(to.xy.y)) return to;
  proj_errno_reset(operation);
  return proj_coord(kNan, kNan, 0.0, 0.0);
}

}  // namespace

ProjOperation::ProjOperation(const PJ* operation, Runs runs, double degrees_per_unit, double prime_meridian_deg)
    : context_(proj::make_context()),
      original_(proj_clone(context_.get(), operation)),
      runs_(runs),
      degrees_per_unit_(degrees_per_unit),
      prime_meridian_deg_(prime_meridian_deg) {}

ProjOperation::Worker ProjOperation::take() const {
  {
    const std::lock_guard lock(mutex_);
    if (!idle_.empty()) {
      Worker worker = std::move(idle_.back());
      idle_.pop_back();
      return worker;
    }
  }
  Worker worker{proj::make_context(), nullptr};
  // Cloning looks at the original.
  const std::lock_guard lock(mutex_);
  worker.operation.reset(proj_clone(worker.context.get(), original_.get()));
  return worker;
}

void ProjOperation::give_back(Worker worker) const {
  const std::lock_guard lock(mutex_);
  idle_.push_back(std::move(worker));
}

GeoPoint ProjOperation::geo_from_map(MapPoint place) const {
  if (!std::isfinite(place.easting) || !std::isfinite(place.northing)) return {kNan, kNan};
  Worker worker = take();
  PJ* const operation = worker.operation.get();
  const PJ_DIRECTION there = runs_ == Runs::kToGeo ? PJ_FWD : PJ_INV;
  const PJ_COORD to = moved(operation, there, place.easting, place.northing);
  bool is_place = !std::isnan(to.xy.x);
  if (is_place && most_apart_ > 0.0) {
    const PJ_COORD back = moved(operation, there == PJ_FWD ? PJ_INV : PJ_FWD, to.xy.x, to.xy.y);
    is_place = std::hypot(back.xy.x - place.easting, back.xy.y - place.northing) <= most_apart_;
  }
  give_back(std::move(worker));
  if (!is_place) return {kNan, kNan};
  return {std::remainder(to.xy.x * degrees_per_unit_ + prime_meridian_deg_, 360.0), to.xy.y * degrees_per_unit_};
}

MapPoint ProjOperation::map_from_geo(GeoPoint place) const {
  if (!std::isfinite(place.longitude) || !std::isfinite(place.latitude)) return {kNan, kNan};
  Worker worker = take();
  const PJ_COORD to = moved(worker.operation.get(), runs_ == Runs::kToGeo ? PJ_INV : PJ_FWD,
                            std::remainder(place.longitude - prime_meridian_deg_, 360.0) / degrees_per_unit_,
                            place.latitude / degrees_per_unit_);
  give_back(std::move(worker));
  return {to.xy.x, to.xy.y};
}

void ProjOperation::find_outline() {
  // The box around the whole body's image: where a corner of it is shown but is no image, the map has an outline.
  constexpr int kAcross = 37;
  constexpr int kDown = 7;
  MapPoint least{HUGE_VAL, HUGE_VAL};
  MapPoint most{-HUGE_VAL, -HUGE_VAL};
  for (int i = 0; i < kAcross * kDown; ++i) {
    const MapPoint at =
        map_from_geo({-179.9 + (i % kAcross) * (359.8 / (kAcross - 1)), -85.0 + (i / kAcross) * (170.0 / (kDown - 1))});
    if (std::isnan(at.easting)) continue;
    least = {std::min(least.easting, at.easting), std::min(least.northing, at.northing)};
    most = {std::max(most.easting, at.easting), std::max(most.northing, at.northing)};
  }
  const double size = std::max(most.easting - least.easting, most.northing - least.northing);
  if (!(size > 0.0) || !std::isfinite(size)) return;
  constexpr double kMostApart = 1e-4;
  for (const MapPoint& corner :
       std::array{least, MapPoint{most.easting, least.northing}, MapPoint{least.easting, most.northing}, most}) {
    const GeoPoint at = geo_from_map(corner);
    if (std::isnan(at.longitude)) continue;
    const MapPoint back = map_from_geo(at);
    const double apart = std::hypot(back.easting - corner.easting, back.northing - corner.northing);
    if (!(apart <= kMostApart * size)) {
      most_apart_ = kMostApart * size;
      return;
    }
  }
}

}  // namespace isohf
