#include "isohf/convert/frame/source_frame.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "isohf/error.h"
#include "isohf/projection/body.h"
#include "isohf/projection/reference_map.h"

namespace isohf {
namespace {

[[noreturn]] void refuse_source(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
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
  throw Error(
      ErrorCode::kUnsupported,
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

/// Of a source's coordinates once round the body; nullopt where no length of them is that.
std::optional<double> turn_of_coordinates(const SourceInfo& info, const ReferenceMap* map) {
  const Georeference& place = info.georeference;
  if (place.unit == HorizontalUnit::kDegree) return 360.0;
  if (map == nullptr || !place.has_origin) return std::nullopt;
  return turn_of(*map, {place.origin_x + 0.5 * static_cast<double>(info.width - 1) * place.spacing_x,
                        place.origin_y - 0.5 * static_cast<double>(info.height - 1) * place.spacing_y});
}

/// The rectangle of its own coordinates that a source covers.
MapBounds bounds_of(const SourceInfo& info, Registration registration) {
  const Georeference& place = info.georeference;
  const double half = registration == Registration::kArea ? 0.5 : 0.0;
  return {place.origin_x - half * place.spacing_x,
          place.origin_y - (static_cast<double>(info.height - 1) + half) * place.spacing_y,
          place.origin_x + (static_cast<double>(info.width - 1) + half) * place.spacing_x,
          place.origin_y + half * place.spacing_y};
}

/// `bounds` of the source on the map of frame.projection; its spacings are those of the ground in the middle.
void place_by_warp(const SourceInfo& info, const ProjectionRequest& asked, const MapBounds& bounds,
                   std::shared_ptr<const ReferenceMap> source_map, SourceFrame& frame) {
  const Georeference& place = info.georeference;
  const ProjectionSpec& spec = frame.projection->spec;
  const auto require_shown = [&](double coordinate) {
    if (std::isfinite(coordinate)) return;
    refuse_source(
        fmt::format("{}: `projection` {} has no place for a part of the input, or its edge runs through it; convert "
                    "what lies within (`bbox`){}",
                    info.path, asked.name(), asked.is_auto ? "" : ", or give `projection` auto"));
  };
  require_shown(bounds.west);
  const double grain = grain_of(std::min(frame.spacing_x, frame.spacing_z));
  const MapPoint origin{std::floor(bounds.west / grain) * grain, std::ceil(bounds.north / grain) * grain};
  frame.size_x = std::ceil((bounds.east - origin.easting) / grain) * grain;
  frame.size_z = std::ceil((origin.northing - bounds.south) / grain) * grain;
  frame.projection->origin = origin;
  frame.warp = WarpPlace{spec,
                         origin,
                         {place.origin_x, place.origin_y},
                         place.spacing_x,
                         place.spacing_y,
                         info.width,
                         info.height,
                         std::move(source_map)};
  const WorldPoint first = ExactWarp(*frame.warp).world_from_source({0.0, 0.0});
  require_shown(first.x);  // the metadata state it
  frame.first_sample_x = first.x;
  frame.first_sample_z = first.z;
}

/// How far lengths err at worst on the ground under a rectangle of another map.
ScaleError worst_scale_error(const Projection& projection, const ReferenceMap& map, const MapBounds& rectangle) {
  constexpr int kSteps = 32;
  ScaleError found;
  found.place = map.geo_from_map(rectangle.middle());
  for (int row = 0; row <= kSteps; ++row) {
    for (int column = 0; column <= kSteps; ++column) {
      const GeoPoint place = map.geo_from_map({rectangle.west + (rectangle.east - rectangle.west) * column / kSteps,
                                               rectangle.north + (rectangle.south - rectangle.north) * row / kSteps});
      const double error = projection.scale(place).error();
      if (error > found.worst) found = {error, place};
    }
  }
  return found;
}

/// A source on a map of its own: what its lengths are worth, and another map where one is asked for.
void place_on_map(const SourceInfo& info, const GroundRequest& request, SourceFrame& frame) {
  const ProjectionRequest& asked = request.projection;
  const bool is_asked = asked.is_given && (asked.is_auto || asked.kind != ProjectionKind::kNone);
  const bool is_placed = request.source_map && info.georeference.has_origin;
  const auto refuse_request = [&](const std::string& why) {
    refuse_source(fmt::format("{}: `projection` {} {}", info.path, asked.name(), why));
  };
  if (!is_placed) {
    if (!is_asked || (asked.is_auto && request.why_no_map.empty())) return;
    refuse_request(request.why_no_map.empty()
                       ? "needs an input in degrees, or on a map that is understood; this one does not say where on "
                         "which map it lies; leave the option out"
                       : "needs to know the input's own map: " + request.why_no_map);
  }
  const ReferenceMap& map = *request.source_map;
  const MapBounds bounds = bounds_of(info, frame.registration);
  frame.ground = ground_under(map, bounds);
  if (!is_asked) return;
  if (request.wrap == Wrap::kAlways)
    refuse_request("and `wrap_x`, which needs the input's rows to stay rows: leave one of them out");
  if (!frame.ground)
    refuse_request("has no place for the input: its own map shows nothing there; leave the option out");
  const MapGround& ground = *frame.ground;
  if (asked.is_auto && ground.worst_error <= MapGround::kTrueEnough) return;
  const bool goes_round = ground.extent.east - ground.extent.west > 359.0;
  const ProjectionChoice choice =
      choose_projection(asked, {info.path, info.georeference.system.body, map.ellipsoid(), ground.extent, goes_round,
                                request.wrap == Wrap::kAlways, false});
  const Projection projection(choice.spec);
  const ScaleError error = worst_scale_error(projection, map, bounds);
  if (asked.is_auto && error.worst >= ground.worst_error) return;
  frame.in_metres = true;
  frame.projection = ProjectionRecord{
      choice.spec,
      {},
      error.worst,
      error.place,
      asked.is_auto ? fmt::format("errs least among the conformal kinds; the input's own map errs by {:.3g} %",
                                  100.0 * ground.worst_error)
                    : choice.why};
  const PlaceScale middle = scale_at(map, bounds.middle());
  const bool is_known = std::isfinite(middle.areal);
  frame.spacing_x *= is_known ? middle.ground_m_per_easting / map.metres_per_unit() : 1.0 / ground.mean_scale;
  frame.spacing_z *= is_known ? middle.ground_m_per_northing / map.metres_per_unit() : 1.0 / ground.mean_scale;
  place_by_warp(info, asked, projected_bounds(projection, map, bounds), request.source_map, frame);
}

void place_degrees(const SourceInfo& info, const GroundRequest& request, SourceFrame& frame) {
  const Georeference& place = info.georeference;
  const GeoExtent ground = ground_of(info, frame.registration);
  ProjectionRequest asked = request.projection;
  if (!place.has_origin) {
    if (!asked.is_auto && asked.kind != ProjectionKind::kEquirectangular && asked.kind != ProjectionKind::kNone) {
      refuse_source(fmt::format("{}: `projection` {} needs to know where the input lies; it has no georeference",
                                info.path, asked.name()));
    }
    if (asked.is_auto) {
      asked.is_auto = false;
      asked.kind = ProjectionKind::kEquirectangular;
    }
  }
  const Closure closure = closure_of(info);
  const ProjectionProblem problem{info.path, place.system.body,         ellipsoid_of(place.system),
                                  ground,    closure != Closure::kOpen, request.wrap == Wrap::kAlways};
  const ProjectionChoice choice = choose_projection(asked, problem);
  if (choice.spec.kind == ProjectionKind::kNone) return;
  if (choice.spec.kind != ProjectionKind::kEquirectangular) check_latitudes(info);
  frame.in_metres = true;
  frame.projection = ProjectionRecord{choice.spec, {}, choice.error.worst, choice.error.place, choice.why};
  if (!place.has_origin) {
    frame.projection->worst_scale_error = std::numeric_limits<double>::infinity();
    frame.projection->worst_place = {0.0, 90.0};
    frame.projection->why = "laid out as at the equator, since the input does not state its position";
  }
  // The middle of the samples, not of the ground, which may have been cut at a pole.
  if (place.has_origin && choice.spec.kind == ProjectionKind::kEquirectangular) {
    frame.projection->spec.latitude_0 = place.origin_y - place.spacing_y * static_cast<double>(info.height - 1) / 2.0;
  }
  frame.samples_wrap = closure == Closure::kClosed;
  if (choice.spec.kind != ProjectionKind::kEquirectangular) {
    if (closure == Closure::kRepeated) frame.samples_wrap = false;
    const DegreeLengths degree = degree_lengths(choice.spec.ellipsoid, ground.middle().latitude);
    frame.spacing_x = place.spacing_x * degree.along_parallel;
    frame.spacing_z = place.spacing_y * degree.along_meridian;
    const Projection projection(choice.spec);
    const MapBounds bounds =
        closure == Closure::kOpen ? projected_bounds(projection, ground) : globe_bounds(projection, ground);
    return place_by_warp(info, asked, bounds, nullptr, frame);
  }
  place_by_scale(frame.projection->spec, info, frame);
}

}  // namespace

Closure closure_of(const SourceInfo& info, const ReferenceMap* map) {
  const Georeference& place = info.georeference;
  const std::optional<double> turn = turn_of_coordinates(info, map);
  if (!turn) return Closure::kOpen;
  const double columns = *turn / place.spacing_x;
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

SourceGeometry SourceFrame::geometry() const {
  SourceGeometry geometry;
  geometry.width = width;
  geometry.height = height;
  geometry.registration = registration;
  geometry.first_sample_x = first_sample_x;
  geometry.first_sample_z = first_sample_z;
  geometry.spacing_x = spacing_x;
  geometry.spacing_z = spacing_z;
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
  } else {
    place_on_map(info, request, frame);
  }
  if (frame.warp) return frame;
  if (frame.registration == Registration::kArea) {
    frame.first_sample_x = frame.spacing_x / 2.0;
    frame.first_sample_z = frame.spacing_z / 2.0;
  }
  const ReferenceMap* const map = request.source_map.get();
  const bool is_closed = closure_of(info, map) == Closure::kClosed;
  // Without a place it is a pattern that goes on with its first column behind its last.
  if (request.wrap == Wrap::kAlways && !is_closed && (place.has_origin || place.unit != HorizontalUnit::kUnknown)) {
    const std::optional<double> turn = turn_of_coordinates(info, map);
    if (!turn) {
      refuse_source(
          info.path +
          ": `wrap_x` joins columns of an input in degrees, on a map whose meridians are evenly spaced columns, or "
          "without a place; this one's are not; leave the option out, or bring it to degrees (gdalwarp)");
    }
    const bool in_degrees = place.unit == HorizontalUnit::kDegree;
    refuse_source(fmt::format(
        "{}: `wrap_x` needs columns all the way round, {}; this input's {} columns {:.12g} apart make {:.12g}",
        info.path, in_degrees ? "360 degrees" : fmt::format("{:.12g} of its map", *turn), info.width, place.spacing_x,
        static_cast<double>(info.width) * place.spacing_x));
  }
  frame.wraps_x = request.wrap == Wrap::kAlways || (request.wrap == Wrap::kAuto && is_closed);
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

std::string scale_warning(const SourceInfo& info, const SourceFrame& frame, const ProjectionRequest& request) {
  if (frame.projection && !request.system_note.empty()) return request.system_note;
  if (frame.projection && !info.georeference.has_origin) {
    return fmt::format(
        "{}: its degrees are laid out as at the equator, since it does not state its position; lengths "
        "from West to East are 41 % too large at latitude 45, and 100 % at 60; give the file its position",
        info.path);
  }
  const bool is_known = request.is_given && !request.is_auto && request.kind == ProjectionKind::kNone;
  if (!frame.ground || frame.projection || is_known || frame.ground->worst_error <= MapGround::kTrueEnough) return {};
  const MapGround& ground = *frame.ground;
  const GeoExtent& extent = ground.extent;
  // No truer map shows more than a hemisphere.
  const bool is_cap = extent.south >= 0.0 || extent.north <= 0.0;
  const char* const remedy =
      request.is_given ? "`projection` none keeps it without a warning"
      : extent.east - extent.west > 180.0 && !is_cap
          ? "a part of it (`bbox`) can be laid on a truer map by `projection` auto; `projection` "
            "none keeps this one without a warning"
          : "`projection` auto lays the surface on a truer map, none keeps this one without a "
            "warning";
  return fmt::format(
      "{}: lengths on its map are {:.4g} times those on the ground ({:.4g} to {:.4g}), and slopes, normals and shadows "
      "wrong by as much; {}",
      info.path, ground.mean_scale, ground.least_scale, ground.most_scale, remedy);
}

SourceFrame make_source_frame(const SourceInfo& info) {
  GroundRequest request;
  request.projection.is_auto = false;
  if (info.georeference.unit == HorizontalUnit::kDegree) request.projection.kind = ProjectionKind::kEquirectangular;
  return make_source_frame(info, request);
}

}  // namespace isohf
