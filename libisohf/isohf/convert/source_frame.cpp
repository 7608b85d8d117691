#include "isohf/convert/source_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/base/error.h"

namespace isohf {
namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

Ellipsoid ellipsoid_of(const ReferenceSystem& system) {
  if (!system.semi_major_axis_m) return {};
  return {*system.semi_major_axis_m, system.inverse_flattening.value_or(0.0)};
}

/// The ground that samples stand for: pixel areas, or posts. Areas end at the poles.
GeoExtent ground_of(const SourceInfo& info, Registration registration) {
  const Georeference& place = info.georeference;
  const double half = registration == Registration::kArea ? 0.5 : 0.0;
  const double north = place.has_origin ? place.origin_y : place.spacing_y * static_cast<double>(info.height - 1) / 2.0;
  GeoExtent ground;
  ground.west = place.origin_x - half * place.spacing_x;
  ground.east = place.origin_x + (static_cast<double>(info.width - 1) + half) * place.spacing_x;
  ground.north = std::min(north + half * place.spacing_y, 90.0);
  ground.south = std::max(north - (static_cast<double>(info.height - 1) + half) * place.spacing_y, -90.0);
  return ground;
}

/// Latitudes that are none are a wrong georeference. Half a spacing is given: areas may be declared by their edges.
void check_latitudes(const SourceInfo& info) {
  const Georeference& place = info.georeference;
  if (!place.has_origin) return;
  const double south = place.origin_y - place.spacing_y * static_cast<double>(info.height - 1);
  const double most = 90.0 + 0.51 * place.spacing_y;
  if (place.origin_y <= most && south >= -most) return;
  refuse(
      fmt::format("{}: reaches from latitude {:.8g} to {:.8g}, beyond a pole; projections need latitudes from -90 to "
                  "90",
                  info.path, south, place.origin_y));
}

/// A power of ten near a thousandth of a length: map places rounded to it hide the last bits of a projection.
double grain_of(double length) {
  return std::pow(10.0, std::floor(std::log10(length)) - 3.0);
}

void place_by_scale(const ProjectionSpec& spec, const SourceInfo& info, SourceFrame& frame) {
  const Georeference& place = info.georeference;
  const DegreeLengths degree = degree_lengths(spec.ellipsoid, spec.latitude_0);
  frame.spacing_x = place.spacing_x * degree.along_parallel;
  frame.spacing_z = place.spacing_y * degree.along_meridian;
}

void place_by_warp(const SourceInfo& info, const GeoExtent& ground, SourceFrame& frame) {
  const Georeference& place = info.georeference;
  const ProjectionSpec& spec = frame.projection->spec;
  const MapBounds bounds = projected_bounds(Projection(spec), ground);
  if (!std::isfinite(bounds.west)) {
    refuse(fmt::format("{}: --projection {} has no place for a part of the input; give --projection auto", info.path,
                       to_string(spec.kind)));
  }
  const DegreeLengths degree = degree_lengths(spec.ellipsoid, ground.middle().latitude);
  frame.spacing_x = place.spacing_x * degree.along_parallel;
  frame.spacing_z = place.spacing_y * degree.along_meridian;
  const double grain = grain_of(std::min(frame.spacing_x, frame.spacing_z));
  const MapPoint origin{std::floor(bounds.west / grain) * grain, std::ceil(bounds.north / grain) * grain};
  frame.size_x = std::ceil((bounds.east - origin.easting) / grain) * grain;
  frame.size_z = std::ceil((origin.northing - bounds.south) / grain) * grain;
  frame.projection->origin = origin;
  frame.warp = WarpPlace{spec,       origin,     {place.origin_x, place.origin_y}, place.spacing_x, place.spacing_y,
                         info.width, info.height};
  const WorldPoint first = ExactWarp(*frame.warp).world_from_source({0.0, 0.0});
  frame.first_sample_x = first.x;
  frame.first_sample_z = first.z;
}

void place_degrees(const SourceInfo& info, const GroundRequest& request, SourceFrame& frame) {
  const Georeference& place = info.georeference;
  const GeoExtent ground = ground_of(info, frame.registration);
  ProjectionRequest asked = request.projection;
  if (!place.has_origin) {
    if (!asked.is_auto && asked.kind != ProjectionKind::kEquirectangular && asked.kind != ProjectionKind::kNone) {
      refuse(fmt::format("{}: --projection {} needs to know where the input lies; it has no georeference", info.path,
                         to_string(asked.kind)));
    }
    if (asked.is_auto) asked = {false, ProjectionKind::kEquirectangular, {}, 0};
  }
  const Closure closure = closure_of(info);
  ProjectionProblem problem{info.path, place.system.body,         ellipsoid_of(place.system),
                            ground,    closure != Closure::kOpen, request.keeps_rows};
  if (request.wrap_x && problem.keeps_rows.empty()) problem.keeps_rows = "--wrap-x";
  const ProjectionChoice choice = choose_projection(asked, problem);
  if (choice.spec.kind == ProjectionKind::kNone) return;
  if (choice.spec.kind != ProjectionKind::kEquirectangular) check_latitudes(info);
  frame.in_metres = true;
  frame.projection = ProjectionRecord{choice.spec, {}, choice.error.worst, choice.error.place, choice.why};
  // The middle of the samples, not of the ground, which may have been cut at a pole.
  if (place.has_origin && choice.spec.kind == ProjectionKind::kEquirectangular) {
    frame.projection->spec.latitude_0 = place.origin_y - place.spacing_y * static_cast<double>(info.height - 1) / 2.0;
  }
  frame.samples_wrap = closure == Closure::kClosed;
  if (choice.spec.kind != ProjectionKind::kEquirectangular) {
    if (closure == Closure::kRepeated) frame.samples_wrap = false;
    return place_by_warp(info, ground, frame);
  }
  place_by_scale(frame.projection->spec, info, frame);
}

}  // namespace

Closure closure_of(const SourceInfo& info) {
  const Georeference& place = info.georeference;
  if (place.unit != HorizontalUnit::kDegree) return Closure::kOpen;
  const double columns = 360.0 / place.spacing_x;
  const auto width = static_cast<double>(info.width);
  constexpr double kTolerance = 0.01;
  if (std::abs(width - columns) <= kTolerance) return Closure::kClosed;
  return std::abs(width - 1.0 - columns) <= kTolerance ? Closure::kRepeated : Closure::kOpen;
}

WorldBounds SourceFrame::bounds() const {
  if (warp) return {0.0, 0.0, size_x, size_z};
  const auto columns = static_cast<double>(registration == Registration::kArea || wraps_x ? width : width - 1);
  const auto rows = static_cast<double>(registration == Registration::kArea ? height : height - 1);
  return {0.0, 0.0, columns * spacing_x, rows * spacing_z};
}

SourceGeometry SourceFrame::geometry(Outside outside) const {
  SourceGeometry geometry;
  geometry.width = width;
  geometry.height = height;
  geometry.registration = registration;
  geometry.first_sample_x = first_sample_x;
  geometry.first_sample_z = first_sample_z;
  geometry.spacing_x = spacing_x;
  geometry.spacing_z = spacing_z;
  geometry.outside = outside;
  geometry.wraps_x = warp ? samples_wrap : wraps_x;
  geometry.warp = warp;
  return geometry;
}

SourceFrame make_source_frame(const SourceInfo& info, const GroundRequest& request) {
  const Georeference& place = info.georeference;
  SourceFrame frame;
  frame.width = info.width;
  frame.height = info.height;
  frame.registration = place.registration;
  if (frame.registration == Registration::kUnknown) {
    frame.registration = place.has_origin ? Registration::kArea : Registration::kPoint;
  }
  frame.spacing_x = place.spacing_x * place.metres_per_unit;
  frame.spacing_z = place.spacing_y * place.metres_per_unit;
  frame.in_metres = place.unit == HorizontalUnit::kMetre;
  if (place.unit == HorizontalUnit::kDegree) {
    place_degrees(info, request, frame);
  } else if (!request.projection.is_auto && request.projection.kind != ProjectionKind::kNone) {
    refuse(fmt::format("{}: --projection {} needs an input in degrees, this one is in {}; leave the option out",
                       info.path, to_string(request.projection.kind),
                       frame.in_metres ? "metres of its own map" : "unknown units"));
  }
  if (frame.warp) return frame;
  if (frame.registration == Registration::kArea) {
    frame.first_sample_x = frame.spacing_x / 2.0;
    frame.first_sample_z = frame.spacing_z / 2.0;
  }
  if (request.wrap_x) {
    if (closure_of(info) != Closure::kClosed) {
      refuse(
          fmt::format("{}: --wrap-x needs columns all the way round, 360 degrees; this input's {} columns {:.9g} "
                      "apart make {:.9g}",
                      info.path, info.width, place.spacing_x,
                      place.unit == HorizontalUnit::kDegree ? static_cast<double>(info.width) * place.spacing_x : 0.0));
    }
    frame.wraps_x = true;
  }
  if (frame.projection) {
    // The middle of the source's rows and columns lies at the map's origin.
    const ProjectionSpec& spec = frame.projection->spec;
    const double west = place.origin_x - (frame.registration == Registration::kArea ? 0.5 * place.spacing_x : 0.0);
    const DegreeLengths degree = degree_lengths(spec.ellipsoid, spec.latitude_0);
    const double north =
        place.has_origin ? place.origin_y : place.spacing_y * static_cast<double>(info.height - 1) / 2.0;
    const double middle_longitude = west + 0.5 * frame.bounds().x1 / degree.along_parallel;
    frame.projection->spec.longitude_0 = std::remainder(middle_longitude, 360.0);
    frame.projection->origin = {(west - middle_longitude) * degree.along_parallel,
                                (north - spec.latitude_0) * degree.along_meridian + frame.first_sample_z};
  }
  return frame;
}

SourceFrame make_source_frame(const SourceInfo& info) {
  return make_source_frame(info, {{false,
                                   info.georeference.unit == HorizontalUnit::kDegree ? ProjectionKind::kEquirectangular
                                                                                     : ProjectionKind::kNone,
                                   {},
                                   0},
                                  false,
                                  ""});
}

}  // namespace isohf
