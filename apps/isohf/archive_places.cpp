#include "archive_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "isohf/base/error.h"
#include "isohf/convert/plan.h"
#include "isohf/projection/projected_extent.h"
#include "isohf/restore/archive_geometry.h"
#include "restored_raster.h"

namespace isohf::cli {
namespace {

constexpr double kTurn = 360.0;

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
}

std::string text_of(const BoundingBox& box) {
  return fmt::format("--bbox {},{},{},{}", box.west, box.south, box.east, box.north);
}

/// World x of coordinates of the source, where rows of the world are its rows.
class SourceColumns {
 public:
  explicit SourceColumns(const SourceRecord& source)
      : first_(source.first_sample_x), origin_(*source.origin_x), scale_(source.spacing_x / source.crs_spacing_x) {}

  [[nodiscard]] double world(double coordinate) const { return first_ + (coordinate - origin_) * scale_; }
  [[nodiscard]] double coordinate(double world) const { return origin_ + (world - first_) / scale_; }

 private:
  double first_;
  double origin_;
  double scale_;
};

/// The box by as many whole turns East that it lies on the archive's ground. `asked`, for messages, is as written.
BoundingBox turned(const BoundingBox& box, const Metadata& metadata, const BoundingBox& asked) {
  const SourceColumns columns(metadata.source);
  const double west = columns.coordinate(metadata.valid.x0);
  const double east = columns.coordinate(metadata.valid.x1);
  const auto by = [&](double turns) {
    return BoundingBox{box.west + turns * kTurn, box.south, box.east + turns * kTurn, box.north};
  };
  // Less than this holds no sample: half of an area, or but the rounding of a post's coordinate.
  const double least = metadata.source.crs_spacing_x * (metadata.source.registration == "area" ? 0.5 : 1e-6);
  const double first = std::ceil((west + least - box.east) / kTurn);
  const double last = std::floor((east - least - box.west) / kTurn);
  if (first > last) return by(std::round((west + east - box.west - box.east) / (2.0 * kTurn)));
  if (first == last) return by(first);
  for (double turns = first; turns <= last; turns += 1.0) {
    const BoundingBox there = by(turns);
    if (there.west <= west + least && there.east >= east - least) return there;
  }
  const BoundingBox there = by(first);
  const BoundingBox again = by(first + 1.0);
  refuse(
      fmt::format("{} lies at the East end and at the West end of the archive's ground, {:.10g} to {:.10g}, which is "
                  "no rectangle of it; give {:.10g} to {:.10g} and {:.10g} to {:.10g} one after the other",
                  text_of(asked), west, east, again.west, east, west, there.east));
}

}  // namespace

WorldBounds world_bounds(const Metadata& metadata, const BoundingBox& asked) {
  const SourceRecord& source = metadata.source;
  if (!source.origin_x || !source.origin_y || !(source.crs_spacing_x > 0.0) || !(source.crs_spacing_y > 0.0)) {
    refuse("the archive does not say where its source lay; coordinates mean nothing");
  }
  const bool degrees = horizontal_unit(source) == HorizontalUnit::kDegree;
  BoundingBox box = asked;
  if (degrees && box.east <= box.west) box.east += kTurn;
  if (!(box.west < box.east)) refuse(fmt::format("{}: West must be less than East", text_of(asked)));
  if (is_warped(metadata)) {
    const ProjectionRecord& on = *metadata.projection;
    const MapBounds map = projected_bounds(Projection(on.spec), {box.west, box.south, box.east, box.north});
    if (!std::isfinite(map.west)) refuse("the archive's map has no place for a part of that");
    return {map.west - on.origin.easting, on.origin.northing - map.north, map.east - on.origin.easting,
            on.origin.northing - map.south};
  }
  if (degrees) box = turned(box, metadata, asked);
  const SourceColumns columns(source);
  const double to_z = source.spacing_z / source.crs_spacing_y;
  WorldBounds bounds;
  bounds.x0 = columns.world(box.west);
  bounds.x1 = columns.world(box.east);
  bounds.z0 = source.first_sample_z + (*source.origin_y - box.north) * to_z;
  bounds.z1 = source.first_sample_z + (*source.origin_y - box.south) * to_z;
  return bounds;
}

SampleGrid grid_like(const Metadata& metadata, const SourceInfo& other) {
  const SourceRecord& source = metadata.source;
  const Georeference& place = other.georeference;
  const bool comparable = source.origin_x && source.origin_y && place.has_origin && source.crs_spacing_x > 0.0 &&
                          source.crs_spacing_y > 0.0 && horizontal_unit(source) == place.unit;
  if (!comparable) {
    const SourceFrame frame = make_source_frame(other);
    return {frame.width,
            frame.height,
            metadata.valid.x0 + frame.first_sample_x,
            metadata.valid.z0 + frame.first_sample_z,
            frame.spacing_x,
            frame.spacing_z};
  }
  const double to_x = source.spacing_x / source.crs_spacing_x;
  const double to_z = source.spacing_z / source.crs_spacing_y;
  return {other.width,
          other.height,
          source.first_sample_x + (place.origin_x - *source.origin_x) * to_x,
          source.first_sample_z + (*source.origin_y - place.origin_y) * to_z,
          place.spacing_x * to_x,
          place.spacing_y * to_z};
}

}  // namespace isohf::cli
