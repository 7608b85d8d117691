#include "isohf/convert/photo_placement.h"

#include <fmt/format.h>

#include <cmath>

#include "isohf/base/error.h"

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

/// False where both sides state something and it is not the same.
bool may_be_the_same(const Georeference& a, const Georeference& b) {
  if (a.unit != HorizontalUnit::kUnknown && b.unit != HorizontalUnit::kUnknown &&
      (a.unit != b.unit || a.metres_per_unit != b.metres_per_unit)) {
    return false;
  }
  if (a.system.epsg && b.system.epsg) return *a.system.epsg == *b.system.epsg;
  if (!a.system.wkt.empty() && !b.system.wkt.empty()) return a.system.wkt == b.system.wkt;
  if (!a.system.name.empty() && !b.system.name.empty()) return a.system.name == b.system.name;
  return true;
}

void place_by_georeference(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame,
                           PhotoPlacement& placement) {
  const Georeference& here = *photo.georeference;
  const Georeference& there = source.georeference;
  if (!may_be_the_same(here, there)) {
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

}  // namespace

PhotoPlacement place_photo(const PhotoInfo& photo, const SourceInfo& source, const SourceFrame& frame) {
  PhotoPlacement placement;
  if (photo.georeference && source.georeference.has_origin) {
    place_by_georeference(photo, source, frame, placement);
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
  return placement;
}

}  // namespace isohf
