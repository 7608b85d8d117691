#include "isohf/convert/frame/photo_placement.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/error.h"
#include "isohf/projection/projected_extent.h"

namespace isohf {
namespace {

/// A photo stretched by more than this to cover the source was hardly made for it.
constexpr double kStretchTold = 1.02;

std::string name_of(const Georeference& place) {
  const ReferenceSystem& system = place.system;
  if (system.epsg) return fmt::format("EPSG:{}", *system.epsg);
  if (!system.name.empty()) return fmt::format("\"{}\"", system.name);
  if (!system.wkt.empty()) return fmt::format("\"{}\"", system.wkt.substr(0, 60));
  if (place.unit == HorizontalUnit::kDegree) return "an unnamed system in degrees";
  return "an unnamed system";
}

/// False where both sides state something and it is not the same. Writers round the length of a foot.
bool may_be_the_same(const Georeference& a, const Georeference& b, std::optional<bool> same_system) {
  if (a.unit != HorizontalUnit::kUnknown && b.unit != HorizontalUnit::kUnknown &&
      (a.unit != b.unit || std::abs(a.metres_per_unit - b.metres_per_unit) > 1e-9 * a.metres_per_unit)) {
    return false;
  }
  if (same_system) return *same_system;
  if (a.system.epsg && b.system.epsg) return *a.system.epsg == *b.system.epsg;
  if (!a.system.wkt.empty() && !b.system.wkt.empty()) return a.system.wkt == b.system.wkt;
  if (!a.system.name.empty() && !b.system.name.empty()) return a.system.name == b.system.name;
  return true;
}

void place_by_georeference(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame,
                           std::optional<bool> same_system, PhotoPlacement& placement) {
  const Georeference& here = *photo.georeference;
  const Georeference& there = source.georeference;
  if (!may_be_the_same(here, there, same_system)) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: is in {}, {} in {}; bring the photo into the same reference system first (gdalwarp)",
                            photo.path, name_of(here), source.path, name_of(there)));
  }
  // World units for one unit of the reference system, as the source's frame has them.
  const double scale_x = frame.spacing_x / there.spacing_x;
  const double scale_z = frame.spacing_z / there.spacing_y;
  placement.frame = {frame.first_sample_x + (here.origin_x - there.origin_x) * scale_x,
                     frame.first_sample_z + (there.origin_y - here.origin_y) * scale_z, here.spacing_x * scale_x,
                     here.spacing_y * scale_z};
  placement.by_georeference = true;
}

void place_over_source(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame,
                       PhotoPlacement& placement) {
  const bool pixel_per_sample = photo.width == frame.width && photo.height == frame.height;
  const WorldBounds bounds = frame.bounds();
  if (pixel_per_sample) {
    placement.frame = {frame.first_sample_x, frame.first_sample_z, frame.spacing_x, frame.spacing_z};
    return;
  }
  const double pixel_x = (bounds.x1 - bounds.x0) / static_cast<double>(photo.width);
  const double pixel_z = (bounds.z1 - bounds.z0) / static_cast<double>(photo.height);
  placement.frame = {bounds.x0 + 0.5 * pixel_x, bounds.z0 + 0.5 * pixel_z, pixel_x, pixel_z};
  const double stretch = pixel_x / pixel_z;
  if (stretch < kStretchTold && stretch > 1.0 / kStretchTold) return;
  placement.warnings.push_back(
      fmt::format("{}: {} x {} pixels are stretched over {} x {} samples, which makes a pixel {:.3g} times as wide as "
                  "high; does it show the same ground?",
                  photo.path, photo.width, photo.height, source.width, source.height, stretch));
}

PhotoPlacement place_on_rows(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame,
                             std::optional<bool> same_system) {
  PhotoPlacement placement;
  if (photo.georeference && source.georeference.has_origin) {
    place_by_georeference(photo, source, frame, same_system, placement);
  } else {
    place_over_source(photo, source, frame, placement);
  }
  const PhotoFrame& at = placement.frame;
  placement.bounds = {at.first_pixel_x - 0.5 * at.spacing_x, at.first_pixel_z - 0.5 * at.spacing_z,
                      at.first_pixel_x + (static_cast<double>(photo.width) - 0.5) * at.spacing_x,
                      at.first_pixel_z + (static_cast<double>(photo.height) - 0.5) * at.spacing_z};
  const WorldBounds ground = frame.bounds();
  const WorldBounds& shown = placement.bounds;
  const bool overlap = shown.x0 < ground.x1 && shown.x1 > ground.x0 && shown.z0 < ground.z1 && shown.z1 > ground.z0;
  if (!overlap) {
    throw Error(ErrorCode::kInvalidArgument,
                fmt::format("{}: shows no ground of {}; by its georeference it lies at x {:.6g}..{:.6g}, z "
                            "{:.6g}..{:.6g}, the source at x {:.6g}..{:.6g}, z {:.6g}..{:.6g}",
                            photo.path, source.path, shown.x0, shown.x1, shown.z0, shown.z1, ground.x0, ground.x1,
                            ground.z0, ground.z1));
  }
  const double half_x = 0.5 * at.spacing_x;
  const double half_z = 0.5 * at.spacing_z;
  placement.is_part = placement.by_georeference && (shown.x0 > ground.x0 + half_x || shown.x1 < ground.x1 - half_x ||
                                                    shown.z0 > ground.z0 + half_z || shown.z1 < ground.z1 - half_z);
  return placement;
}

/// A world of the source's own units, East and South of its North-West corner.
SourceFrame own_units_of(const SourceInfo& source, const SourceFrame& frame) {
  SourceFrame own;
  own.width = frame.width;
  own.height = frame.height;
  own.registration = frame.registration;
  own.spacing_x = source.georeference.spacing_x;
  own.spacing_z = source.georeference.spacing_y;
  if (frame.registration == Registration::kArea) {
    own.first_sample_x = own.spacing_x / 2.0;
    own.first_sample_z = own.spacing_z / 2.0;
  }
  return own;
}

/// The photo with its longitudes counted from the turn that lies nearest to the source's.
PhotoInfo on_the_same_turn(const PhotoInfo& photo, const SourceInfo& source) {
  PhotoInfo turned = photo;
  if (!turned.georeference || source.georeference.unit != HorizontalUnit::kDegree) return turned;
  const auto middle = [](const Georeference& place, std::int64_t width) {
    return place.origin_x + place.spacing_x * static_cast<double>(width - 1) / 2.0;
  };
  const double apart = middle(source.georeference, source.width) - middle(*turned.georeference, turned.width);
  turned.georeference->origin_x += 360.0 * std::round(apart / 360.0);
  return turned;
}

PhotoPlacement place_by_projection(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame,
                                   std::optional<bool> same_system) {
  const SourceFrame own_units = own_units_of(source, frame);
  PhotoPlacement placement = place_on_rows(on_the_same_turn(photo, source), source, own_units, same_system);
  const PhotoFrame in_own_units = placement.frame;
  const Georeference& there = source.georeference;
  const double west = there.origin_x - own_units.first_sample_x;
  const double north = there.origin_y + own_units.first_sample_z;
  WarpPlace warp = *frame.warp;
  warp.first_sample = {west + in_own_units.first_pixel_x, north - in_own_units.first_pixel_z};
  warp.step_x = in_own_units.spacing_x;
  warp.step_z = in_own_units.spacing_z;
  warp.width = photo.width;
  warp.height = photo.height;

  WorldBounds shown = own_units.bounds();
  const bool goes_round = !warp.source_map && placement.bounds.x1 - placement.bounds.x0 > 360.0 - 0.5 * warp.step_x;
  // Its West is what lies beyond its East.
  if (goes_round) placement.is_part = false;
  if (!goes_round) {
    shown.x0 = std::max(shown.x0, placement.bounds.x0);
    shown.x1 = std::min(shown.x1, placement.bounds.x1);
  }
  shown.z0 = std::max(shown.z0, placement.bounds.z0);
  shown.z1 = std::min(shown.z1, placement.bounds.z1);
  const MapBounds ground{west + shown.x0, north - shown.z1, west + shown.x1, north - shown.z0};
  const Projection world(warp.projection);
  const MapBounds map = warp.source_map ? projected_bounds(world, *warp.source_map, ground)
                                        : projected_bounds(world, {ground.west, std::max(ground.south, -90.0),
                                                                   ground.east, std::min(ground.north, 90.0)});
  placement.bounds = {map.west - warp.origin.easting, warp.origin.northing - map.north, map.east - warp.origin.easting,
                      warp.origin.northing - map.south};
  const double scale_x = frame.spacing_x / there.spacing_x;
  const double scale_z = frame.spacing_z / there.spacing_y;
  placement.frame = {placement.bounds.x0 + 0.5 * warp.step_x * scale_x,
                     placement.bounds.z0 + 0.5 * warp.step_z * scale_z, warp.step_x * scale_x, warp.step_z * scale_z};
  placement.warp = warp;
  return placement;
}

}  // namespace

PhotoPlacement place_photo(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame,
                           std::optional<bool> same_system) {
  return frame.warp ? place_by_projection(photo, source, frame, same_system)
                    : place_on_rows(photo, source, frame, same_system);
}

}  // namespace isohf
