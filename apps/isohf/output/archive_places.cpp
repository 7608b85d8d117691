#include "output/archive_places.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "formats/georeference/reference_system.h"
#include "isohf/convert/frame/plan.h"
#include "isohf/error.h"
#include "isohf/projection/projected_extent.h"
#include "isohf/projection/projection_wkt.h"
#include "isohf/restore/archive_geometry.h"
#include "raster/restored_raster.h"

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
  const double least =
      metadata.source.crs_spacing_x * (metadata.source.registration == Registration::kArea ? 0.5 : 1e-6);
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

std::string describe_unit(HorizontalUnit unit) {
  return unit == HorizontalUnit::kDegree ? "degrees" : unit == HorizontalUnit::kMetre ? "metres" : "an unknown unit";
}

std::string describe_system(const ReferenceSystem& system) {
  if (system.epsg) return fmt::format("EPSG:{}", *system.epsg);
  return system.name.empty() ? "no named reference system" : "\"" + system.name + "\"";
}

/// Refuses coordinates that are known to mean another ground than the source's.
void check_same_system(const Metadata& metadata, const SourceInfo& other) {
  const SourceRecord& source = metadata.source;
  const Georeference& place = other.georeference;
  const HorizontalUnit unit = horizontal_unit(source);
  const bool units_known = unit != HorizontalUnit::kUnknown && place.unit != HorizontalUnit::kUnknown;
  if (units_known && unit != place.unit) {
    refuse(fmt::format(
        "{}: is in {}, the archive's source in {}; bring it to the source's reference system, {} "
        "(gdalwarp)",
        other.path, describe_unit(place.unit), describe_unit(unit), describe_system(horizontal_system(source))));
  }
  if (!source.body.empty() && !place.system.body.empty() && source.body != place.system.body) {
    refuse(fmt::format("{}: is of {}, the archive of {}", other.path, place.system.body, source.body));
  }
  // Datums of the ellipsoids of WGS 84 and GRS 80 lie within metres of each other, those of others a hundred apart.
  constexpr double kSameEllipsoid = 1e-5;
  const auto& theirs = place.system.semi_major_axis_m;
  const std::optional<double> ours =
      metadata.projection ? metadata.projection->spec.ellipsoid.semi_major_axis_m : source.semi_major_axis_m;
  const bool same_ellipsoid = !theirs || !ours || std::abs(*theirs - *ours) <= kSameEllipsoid * *ours;
  bool same = same_ellipsoid;
  if (unit == HorizontalUnit::kMetre && units_known) {
    const double metres = source.spacing_x / source.crs_spacing_x;
    same = same && std::abs(place.metres_per_unit - metres) <= 1e-9 * metres &&
           (!source.crs_epsg || !place.system.epsg || source.crs_epsg == place.system.epsg);
  }
  if (same) return;
  refuse(fmt::format("{}: is in {}, the archive's source in {}; bring it to that (gdalwarp)", other.path,
                     describe_system(place.system), describe_system(horizontal_system(source))));
}

/// Whether a reference system is that which rasters of the archive's map are written in.
bool is_own_map(const Metadata& metadata, const SourceInfo& other) {
  const Georeference own = map_georeference(metadata, natural_grid(metadata));
  const Georeference& place = other.georeference;
  if (place.unit != HorizontalUnit::kMetre || place.metres_per_unit != 1.0) return false;
  if (own.system.epsg || place.system.epsg) return own.system.epsg == place.system.epsg;
  if (!place.system.wkt.empty()) return own.system.wkt == place.system.wkt;
  if (own.system.name != place.system.name) return false;
  // The name has no body in it.
  if (place.system.semi_major_axis_m) return own.system.semi_major_axis_m == place.system.semi_major_axis_m;
  return !place.system.body.empty() && own.system.body == place.system.body;
}

/// The grid of a raster beside an archive whose rows are no rows of its source.
OutputGrid grid_through_map(const Metadata& metadata, const SourceInfo& other) {
  const ProjectionRecord& on = *metadata.projection;
  const Georeference& place = other.georeference;
  if (place.has_origin && is_own_map(metadata, other)) {
    return OutputGrid({other.width, other.height, place.origin_x - on.origin.easting,
                       on.origin.northing - place.origin_y, place.spacing_x, place.spacing_y});
  }
  const std::string map = describe_projection(on.spec);
  if (horizontal_unit(metadata.source) != HorizontalUnit::kDegree) {
    refuse(
        fmt::format("{}: the archive's input was laid on another map; only a raster on that ({}) has a place there; "
                    "bring it there (gdalwarp)",
                    other.path, map));
  }
  if (!place.has_origin || place.unit != HorizontalUnit::kDegree) {
    refuse(fmt::format(
        "{}: {}; the archive's input was in degrees and was projected, so that only a raster in degrees "
        "or on that map ({}) has a place there; bring it to degrees (gdalwarp)",
        other.path,
        place.has_origin ? fmt::format("is in {} of {}", describe_unit(place.unit), describe_system(place.system))
                         : std::string("does not say where it lies"),
        map));
  }
  check_same_system(metadata, other);
  OutputGrid grid;
  grid.world.width = other.width;
  grid.world.height = other.height;
  grid.degrees = GeoGrid{other.width, other.height, {place.origin_x, place.origin_y}, place.spacing_x, place.spacing_y};
  if (place.registration != Registration::kUnknown) grid.registration = place.registration;
  return grid;
}

/// Whether a raster and the archive's source share ground where the coordinates of both are of one kind.
bool share_ground(const SourceRecord& source, const SourceInfo& other) {
  const Georeference& place = other.georeference;
  const auto overlap = [](double a0, double a1, double b0, double b1) { return a0 <= b1 && b0 <= a1; };
  const double east = *source.origin_x + static_cast<double>(source.width) * source.crs_spacing_x;
  const double south = *source.origin_y - static_cast<double>(source.height) * source.crs_spacing_y;
  return overlap(*source.origin_x, east, place.origin_x,
                 place.origin_x + static_cast<double>(other.width) * place.spacing_x) &&
         overlap(south, *source.origin_y, place.origin_y - static_cast<double>(other.height) * place.spacing_y,
                 place.origin_y);
}

}  // namespace

void understand_source(ArchiveReader& archive) {
  const SourceRecord& source = archive.metadata().source;
  if (source.map || horizontal_unit(source) != HorizontalUnit::kMetre) return;
  const std::string text = system_text(horizontal_system(source));
  if (text.empty()) refuse(archive.path() + ": names no reference system: it cannot be told where its metres lie");
  try {
    archive.set_source_map(understand_map(text, source.metres_per_unit));
  } catch (const Error& error) {
    throw Error(error.code(), archive.path() + ": " + error.what());
  }
}

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
    const Projection world(on.spec);
    const MapBounds map =
        degrees ? projected_bounds(world, GeoExtent{box.west, box.south, box.east, box.north})
                : projected_bounds(world, *source.map, MapBounds{box.west, box.south, box.east, box.north});
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

OutputGrid grid_like(const Metadata& metadata, const SourceInfo& other, std::vector<std::string>& warnings) {
  if (is_warped(metadata)) return grid_through_map(metadata, other);
  const SourceRecord& source = metadata.source;
  const Georeference& place = other.georeference;
  const HorizontalUnit unit = horizontal_unit(source);
  const bool placed = source.origin_x && source.origin_y && place.has_origin && source.crs_spacing_x > 0.0 &&
                      source.crs_spacing_y > 0.0;
  if (placed) check_same_system(metadata, other);
  const bool same_unit = unit == place.unit || (placed && share_ground(source, other));
  if (placed && unit != place.unit) {
    warnings.push_back(fmt::format(
        "{}: does not say what its coordinates count (a .prj would); {}", other.path,
        same_unit ? "they are taken for those of the archive's reference system, on whose ground they lie"
                  : "on the archive's ground they do not lie, so its grid begins in the North-West corner there"));
  }
  if (!placed && source.origin_x) {
    warnings.push_back(fmt::format(
        "{}: does not say where it lies; its grid begins in the North-West corner of the archive", other.path));
  }
  if (!placed || !same_unit) {
    const SourceFrame frame = make_source_frame(other);
    return OutputGrid({frame.width, frame.height, metadata.valid.x0 + frame.first_sample_x,
                       metadata.valid.z0 + frame.first_sample_z, frame.spacing_x, frame.spacing_z});
  }
  const double to_x = source.spacing_x / source.crs_spacing_x;
  const double to_z = source.spacing_z / source.crs_spacing_y;
  double east = place.origin_x - *source.origin_x;
  if (unit == HorizontalUnit::kDegree) {
    // As many turns on as bring the middles nearest to each other.
    const double apart = east + 0.5 * (static_cast<double>(other.width - 1) * place.spacing_x -
                                       static_cast<double>(source.width - 1) * source.crs_spacing_x);
    east -= kTurn * std::round(apart / kTurn);
  }
  return OutputGrid({other.width, other.height, source.first_sample_x + east * to_x,
                     source.first_sample_z + (*source.origin_y - place.origin_y) * to_z, place.spacing_x * to_x,
                     place.spacing_y * to_z});
}

}  // namespace isohf::cli
