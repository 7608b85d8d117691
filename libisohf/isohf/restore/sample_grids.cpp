#include "isohf/restore/sample_grids.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "isohf/archive/metadata/cut_record.h"
#include "isohf/base/handed_in.h"
#include "isohf/error.h"
#include "isohf/projection/projected_extent.h"
#include "isohf/projection/projection_wkt.h"

namespace isohf {
namespace {

constexpr double kTurn = 360.0;

/// Where a grid of the world lies on the map that the source was projected to, its samples areas.
Georeference map_georeference(const Metadata& metadata, const SampleGrid& grid) {
  const SourceRecord& source = metadata.source;
  const ProjectionRecord& on = *metadata.projection;
  Georeference place;
  place.registration = Registration::kArea;
  place.unit = HorizontalUnit::kMetre;
  const double metres = place.metres_per_unit = on.spec.system.metres_per_unit;
  place.spacing_x = grid.spacing_x / metres;
  place.spacing_y = grid.spacing_z / metres;
  place.has_origin = true;
  place.origin_x = (on.origin.easting + grid.first_x) / metres;
  place.origin_y = (on.origin.northing - grid.first_z) / metres;
  // A map's own code and name are none of degrees.
  const bool in_degrees = source_georeference(source).unit == HorizontalUnit::kDegree;
  place.system.epsg = projection_epsg(on.spec, in_degrees ? source.crs_epsg : std::nullopt);
  place.system.name = on.spec.system.name.empty() ? describe_projection(on.spec) : on.spec.system.name;
  if (!place.system.epsg) place.system.wkt = projection_wkt(on.spec, in_degrees ? source.crs_name : "");
  place.system.body = source.body;
  // A reference system has an ellipsoid of its own; the record has that of longitudes and latitudes.
  if (on.spec.kind != ProjectionKind::kSystem) {
    place.system.semi_major_axis_m = on.spec.ellipsoid.semi_major_axis_m;
    place.system.inverse_flattening = on.spec.ellipsoid.inverse_flattening;
  }
  place.system.vertical_datum = source.vertical_datum;
  place.system.vertical_epsg = source.vertical_epsg;
  return place;
}

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kInvalidArgument, why);
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

/// Of the source's coordinates once round the body; nullopt where it is not known that they go on there.
std::optional<double> once_round(const Metadata& metadata) {
  const SourceRecord& source = metadata.source;
  if (source.crs_unit == "degree") return kTurn;
  if (!metadata.wraps_x) return std::nullopt;
  return static_cast<double>(source.width) * source.crs_spacing_x;
}

/// The box by as many whole turns East that it lies on the archive's ground, which reaches from `west` to `east`.
MapBounds turned(const MapBounds& box, double west, double east, const SourceRecord& source, double turn,
                 AcrossEnds across) {
  const auto by = [&](double turns) {
    return MapBounds{box.west + turns * turn, box.south, box.east + turns * turn, box.north};
  };
  // Less than this holds no sample: half of an area, or but the rounding of a post's coordinate.
  const double least = source.crs_spacing_x * (source.registration == Registration::kArea ? 0.5 : 1e-6);
  const double first = std::ceil((west + least - box.east) / turn);
  const double last = std::floor((east - least - box.west) / turn);
  if (first > last) return by(std::round((west + east - box.west - box.east) / (2.0 * turn)));
  if (first == last) return by(first);
  for (double turns = first; turns <= last; turns += 1.0) {
    const MapBounds there = by(turns);
    if (there.west <= west + least && there.east >= east - least) return there;
  }
  const MapBounds there = by(first);
  const MapBounds again = by(first + 1.0);
  if (across == AcrossEnds::kGoesOn && east - west >= turn * (1.0 - 1e-9)) return again;
  refuse(
      fmt::format("lies at the East end and at the West end of the archive's ground, {:.10g} to {:.10g}, which is "
                  "no rectangle of it; give {:.10g} to {:.10g} and {:.10g} to {:.10g} one after the other",
                  west, east, again.west, east, west, there.east));
}

/// Longitudes and latitudes as a map of their own.
class DegreeMap final : public ReferenceMap {
 public:
  explicit DegreeMap(const Ellipsoid& ellipsoid) : ellipsoid_(ellipsoid) {}

  [[nodiscard]] GeoPoint geo_from_map(MapPoint place) const override {
    return {std::remainder(place.easting, kTurn), place.northing};
  }
  [[nodiscard]] MapPoint map_from_geo(GeoPoint place) const override { return {place.longitude, place.latitude}; }
  [[nodiscard]] double metres_per_unit() const override { return 1.0; }
  [[nodiscard]] const Ellipsoid& ellipsoid() const override { return ellipsoid_; }

 private:
  Ellipsoid ellipsoid_;
};

/// That of a projected source. Throws Error{kInvalidArgument} where it is a map that is not understood.
std::shared_ptr<const GridSystem> system_of_source(const Metadata& metadata) {
  const Georeference place = source_georeference(metadata.source);
  if (place.unit == HorizontalUnit::kDegree)
    return std::make_shared<GridSystem>(
        GridSystem{std::make_shared<DegreeMap>(metadata.projection->spec.ellipsoid), place});
  if (metadata.source.map) return std::make_shared<GridSystem>(GridSystem{metadata.source.map, place});
  refuse(fmt::format("the reference system of its source, {}, is not understood", describe_system(place.system)));
}

/// Refuses coordinates that are known to mean another ground than the source's.
void check_same_system(const Metadata& metadata, const SourceInfo& other) {
  const SourceRecord& source = metadata.source;
  const Georeference& theirs = other.georeference;
  const HorizontalUnit unit = source_georeference(source).unit;
  const bool units_known = unit != HorizontalUnit::kUnknown && theirs.unit != HorizontalUnit::kUnknown;
  if (units_known && unit != theirs.unit) {
    refuse(
        fmt::format("{}: is in {}, the archive's source in {}; bring it to the source's reference system, {} "
                    "(gdalwarp)",
                    other.path, describe_unit(theirs.unit), describe_unit(unit),
                    describe_system(source_georeference(source).system)));
  }
  if (!source.body.empty() && !theirs.system.body.empty() && source.body != theirs.system.body) {
    refuse(fmt::format("{}: is of {}, the archive of {}", other.path, theirs.system.body, source.body));
  }
  // Datums of the ellipsoids of WGS 84 and GRS 80 lie within metres of each other, those of others a hundred apart.
  constexpr double kSameEllipsoid = 1e-5;
  const auto& their_axis = theirs.system.semi_major_axis_m;
  const std::optional<double> ours =
      metadata.projection ? metadata.projection->spec.ellipsoid.semi_major_axis_m : source.semi_major_axis_m;
  const bool same_ellipsoid = !their_axis || !ours || std::abs(*their_axis - *ours) <= kSameEllipsoid * *ours;
  bool same = same_ellipsoid;
  if (unit == HorizontalUnit::kMetre && units_known) {
    const double metres = source.metres_per_unit;
    same = same && std::abs(theirs.metres_per_unit - metres) <= 1e-9 * metres &&
           (!source.crs_epsg || !theirs.system.epsg || source.crs_epsg == theirs.system.epsg);
    const bool by_text = !source.crs_epsg && !theirs.system.epsg && !theirs.system.wkt.empty();
    if (by_text && !source.crs_wkt.empty()) same = same && source.crs_wkt == theirs.system.wkt;
  }
  if (same) return;
  const ReferenceSystem own = source_georeference(source).system;
  if (!same_ellipsoid) {
    refuse(
        fmt::format("{}: is in {} with an equatorial radius of {:.10g} m, the archive's source in {} with one of "
                    "{:.10g} m; bring it to that (gdalwarp)",
                    other.path, describe_system(theirs.system), *their_axis, describe_system(own), *ours));
  }
  refuse_system(other, own);
}

/// Whether a reference system is that which rasters of the archive's map are written in.
bool is_own_map(const Metadata& metadata, const SourceInfo& other) {
  const Georeference own = map_georeference(metadata, natural_grid(metadata));
  const Georeference& theirs = other.georeference;
  if (theirs.unit != HorizontalUnit::kMetre || theirs.metres_per_unit != own.metres_per_unit) return false;
  if (own.system.epsg || theirs.system.epsg) return own.system.epsg == theirs.system.epsg;
  if (!theirs.system.wkt.empty()) return own.system.wkt == theirs.system.wkt;
  if (own.system.name != theirs.system.name) return false;
  // The name has no body in it.
  if (theirs.system.semi_major_axis_m) return own.system.semi_major_axis_m == theirs.system.semi_major_axis_m;
  return !theirs.system.body.empty() && own.system.body == theirs.system.body;
}

/// The grid of a raster beside an archive whose rows are no rows of its source.
SampleGrid grid_through_map(const Metadata& metadata, const SourceInfo& other) {
  const ProjectionRecord& on = *metadata.projection;
  const Georeference& theirs = other.georeference;
  if (theirs.has_origin && is_own_map(metadata, other)) {
    const double metres = on.spec.system.metres_per_unit;
    return {other.width,
            other.height,
            theirs.origin_x * metres - on.origin.easting,
            on.origin.northing - theirs.origin_y * metres,
            theirs.spacing_x * metres,
            theirs.spacing_y * metres};
  }
  const std::string map = describe_projection(on.spec);
  const Georeference source = source_georeference(metadata.source);
  SampleGrid grid{other.width,      other.height, theirs.origin_x, theirs.origin_y, theirs.spacing_x,
                  theirs.spacing_y, true};
  if (theirs.registration != Registration::kUnknown) grid.registration = theirs.registration;
  if (source.unit != HorizontalUnit::kDegree) {
    if (!theirs.has_origin) {
      refuse(
          fmt::format("{}: does not say where it lies; only a raster in the reference system of the archive's "
                      "input, {}, or on its map ({}) has a place there",
                      other.path, describe_system(source.system), map));
    }
    check_same_system(metadata, other);
    grid.in_degrees = false;
    grid.system = system_of_source(metadata);
    return grid;
  }
  if (!theirs.has_origin || theirs.unit != HorizontalUnit::kDegree) {
    refuse(fmt::format(
        "{}: {}; the archive's input was in degrees and was projected, so that only a raster in degrees "
        "or on that map ({}) has a place there; bring it to degrees (gdalwarp)",
        other.path,
        theirs.has_origin ? fmt::format("is in {} of {}", describe_unit(theirs.unit), describe_system(theirs.system))
                          : std::string("does not say where it lies"),
        map));
  }
  check_same_system(metadata, other);
  return grid;
}

/// Whether a raster and the archive's source share ground where the coordinates of both are of one kind.
bool share_ground(const SourceRecord& source, const SourceInfo& other) {
  const Georeference& theirs = other.georeference;
  const auto overlap = [](double a0, double a1, double b0, double b1) { return a0 <= b1 && b0 <= a1; };
  const double east = *source.origin_x + static_cast<double>(source.width) * source.crs_spacing_x;
  const double south = *source.origin_y - static_cast<double>(source.height) * source.crs_spacing_y;
  return overlap(*source.origin_x, east, theirs.origin_x,
                 theirs.origin_x + static_cast<double>(other.width) * theirs.spacing_x) &&
         overlap(south, *source.origin_y, theirs.origin_y - static_cast<double>(other.height) * theirs.spacing_y,
                 theirs.origin_y);
}

/// Where ground of an archive lies in another reference system.
class ImageFinder {
 public:
  ImageFinder(const Metadata& metadata, const GridSystem& system) : places_(metadata), system_(system) {
    if (!places_.has_geo()) refuse("the archive does not say where it lies; coordinates mean nothing");
    const WorldBounds& all = metadata.valid;
    const WorldPoint middle{(all.x0 + all.x1) / 2.0, (all.z0 + all.z1) / 2.0};
    const GeoPoint geo = places_.geo_from_world(middle);
    const bool own = metadata.source.crs_unit == "degree" && places_.has_source();
    const double longitude = own ? places_.source_from_world(middle).easting : geo.longitude;
    if (std::isfinite(longitude)) middle_ = longitude;
    half_round_ = M_PI * system.map->ellipsoid().semi_major_axis_m / system.place.metres_per_unit;
    // Maps that show poles as points go round them; others are as wide as the body is round, and cut open anywhere.
    const auto north = pole_image(90.0);
    const auto south = pole_image(-90.0);
    const auto apart = [](const MapPoint& a, const MapPoint& b) {
      return std::hypot(a.easting - b.easting, a.northing - b.northing);
    };
    if (north && south && apart(*north, *south) <= 2.0 * half_round_) {
      centre_ = {(north->easting + south->easting) / 2.0, (north->northing + south->northing) / 2.0};
    } else if (north && south) {
      // A stereographic map shows the far one nearly for ever away.
      const MapPoint at = system.map->map_from_geo(geo);
      centre_ = apart(at, *south) < apart(at, *north) ? *south : *north;
    } else if (north || south) {
      centre_ = north ? *north : *south;
    } else {
      reach_x_ = 2.0;
      const MapPoint equator = system.map->map_from_geo({middle_, 0.0});
      if (std::isfinite(equator.easting) && std::isfinite(equator.northing)) centre_ = equator;
    }
  }

  [[nodiscard]] ShownImage image_of(const WorldBounds& ground) const {
    constexpr int kStepsPerSide = 128;
    const MapBounds rectangle{ground.x0, -ground.z1, ground.x1, -ground.z0};
    const auto image = [this](const MapPoint& at) { return image_at(at); };
    const MapBounds whole = image_bounds(rectangle, image, kStepsPerSide);
    if (std::isfinite(whole.west) && surrounds(whole, rectangle, image)) {
      const double area = (whole.east - whole.west) * (whole.north - whole.south);
      return {whole, area / ((ground.x1 - ground.x0) * (ground.z1 - ground.z0))};
    }
    std::vector<MapPoint> poles;
    for (const double pole : {90.0, -90.0}) {
      const WorldPoint at = places_.world_from_geo({middle_, pole});
      if (at.x >= ground.x0 && at.x <= ground.x1 && at.z >= ground.z0 && at.z <= ground.z1)
        poles.push_back({at.x, -at.z});
    }
    const ShownImage shown = shown_image(rectangle, image, poles);
    if (std::isfinite(shown.bounds.west)) return shown;
    refuse(fmt::format("{} shows nothing of the ground; name a system for that part of the body",
                       describe_system(system_.place.system)));
  }

 private:
  /// nullopt where the map does not show the pole as a point. A shift of the datum has the map's own pole lie beside
  /// it: an arc or a place that is nowhere is known by the circles round the pole, which do not shrink to a point.
  [[nodiscard]] std::optional<MapPoint> pole_image(double latitude) const {
    const auto across = [&](double degrees) {
      const double at = std::copysign(90.0 - degrees, latitude);
      double widest = 0.0;
      for (const double turn : {90.0, 180.0, 270.0}) {
        const MapPoint here = system_.map->map_from_geo({middle_, at});
        const MapPoint other = system_.map->map_from_geo({std::remainder(middle_ + turn, kTurn), at});
        widest = std::max(widest, std::hypot(here.easting - other.easting, here.northing - other.northing));
      }
      return widest;
    };
    constexpr double kShrunk = 0.9;  // circles of a tenth; a flat cone's by (1/10)^n
    if (!(across(0.1) < kShrunk * across(1.0))) return std::nullopt;
    const MapPoint pole = system_.map->map_from_geo({middle_, latitude});
    if (!std::isfinite(pole.easting) || !std::isfinite(pole.northing)) return std::nullopt;
    return pole;
  }

  /// NaN where the map does not show it, or where maps like Mercator's and the stereographic go on for ever.
  [[nodiscard]] MapPoint image_at(const MapPoint& at) const {
    GeoPoint geo = places_.geo_from_world({at.easting, -at.northing});
    geo.latitude = std::clamp(geo.latitude, -90.0, 90.0);
    MapPoint there = system_.map->map_from_geo(geo);
    if (system_.place.unit == HorizontalUnit::kDegree) {
      there.easting = middle_ + std::remainder(there.easting - middle_, kTurn);
      return there;
    }
    const double reach = half_round_ * (1.0 + 1e-9);
    if (std::abs(there.northing - centre_.northing) > reach) return {NAN, NAN};
    if (std::abs(there.easting - centre_.easting) > reach * reach_x_) return {NAN, NAN};
    return there;
  }

  WorldGeoreference places_;
  const GridSystem& system_;
  double middle_ = 0.0;      ///< longitude, as the source counts them
  double half_round_ = 0.0;  ///< the body's half circumference, units of the map
  MapPoint centre_{};        ///< of what is shown, which reaches half_round_ from it
  double reach_x_ = 1.0;     ///< East and West so many times as far
};

}  // namespace

double Turn::onto_ground(double x, double tolerance) const {
  if (x >= ground_x0 - tolerance && x <= ground_x1 + tolerance) return x;
  const double there = x - length * std::floor((x - ground_x0 + tolerance) / length);
  return there <= ground_x1 + tolerance ? there : x;
}

std::string describe_unit(HorizontalUnit unit) {
  return unit == HorizontalUnit::kDegree ? "degrees" : unit == HorizontalUnit::kMetre ? "metres" : "an unknown unit";
}

std::string describe_system(const ReferenceSystem& system) {
  if (system.epsg) return fmt::format("EPSG:{}", *system.epsg);
  // PROJ's word where a PROJ string names none.
  if (!system.name.empty() && system.name != "unknown") return "\"" + system.name + "\"";
  return "a reference system without a name";
}

void refuse_system(const SourceInfo& other, const ReferenceSystem& own) {
  const auto& code = other.georeference.system.epsg;
  refuse(
      fmt::format("{}: is in {}, the archive's source in {}; bring it to that (gdalwarp), or write all of the archive "
                  "in its system, with `projection` {} instead of `like`",
                  other.path, describe_system(other.georeference.system), describe_system(own),
                  code ? fmt::format("EPSG:{}", *code) : "SYSTEM"));
}

std::optional<Turn> turn_of(const Metadata& metadata) {
  const SourceRecord& source = metadata.source;
  const std::optional<double> turn = once_round(metadata);
  if (is_warped(metadata) || !turn || !source.origin_x || !(source.crs_spacing_x > 0.0)) return std::nullopt;
  return Turn{*turn / source.crs_spacing_x * source.spacing_x, metadata.valid.x0, metadata.valid.x1};
}

SampleGrid source_grid(const SourceRecord& source) {
  return {source.width,          source.height,    source.first_sample_x,
          source.first_sample_z, source.spacing_x, source.spacing_z};
}

namespace {

/// With the one that repeats the first.
std::int64_t all_columns(const SourceRecord& source) {
  return source.width + (source.repeats_column ? 1 : 0);
}

}  // namespace

SampleGrid natural_grid(const Metadata& metadata) {
  const WorldBounds& ground = metadata.valid;
  if (!is_warped(metadata)) {
    SampleGrid all = source_grid(metadata.source);
    all.width = all_columns(metadata.source);
    return is_cut(metadata) ? part_of(all, ground).value_or(all) : all;
  }
  SampleGrid grid;
  // One area for one of the source's, in the middle of its ground.
  grid.spacing_x = grid.spacing_z = std::sqrt(metadata.source.spacing_x * metadata.source.spacing_z);
  grid.width = std::max(std::llround((ground.x1 - ground.x0) / grid.spacing_x), 1LL);
  grid.height = std::max(std::llround((ground.z1 - ground.z0) / grid.spacing_z), 1LL);
  grid.first_x = ground.x0 + grid.spacing_x / 2.0;
  grid.first_z = ground.z0 + grid.spacing_z / 2.0;
  return grid;
}

namespace {

void require_spacing(const std::optional<double>& spacing) {
  if (spacing && !(*spacing > 0.0 && std::isfinite(*spacing)))
    refuse(fmt::format("`spacing` is {}, must be above 0", *spacing));
}

/// Before numbers of samples become whole.
void require_fewer(double columns, double rows) {
  if (std::max(columns, rows) < static_cast<double>(kMaxSide)) return;
  refuse(fmt::format("`spacing` makes {:.3g} x {:.3g} samples", columns, rows));
}

}  // namespace

SampleGrid grid_over(const WorldBounds& ground, bool areas, const std::optional<GridSize>& size,
                     const std::optional<double>& spacing) {
  if (!size && !spacing) refuse("a grid needs `size` or `spacing`");
  require_spacing(spacing);
  const double width = ground.x1 - ground.x0;
  const double height = ground.z1 - ground.z0;
  // Posts on the ground, and areas whose middle lies on it.
  const auto count = [&](double length) {
    if (length > 0.0 && *spacing > 2.0 * length) {
      refuse(fmt::format("`spacing` of {:.6g} is wider than the ground, {:.6g} x {:.6g}", *spacing, width, height));
    }
    const double steps = length / *spacing * (1.0 + 1e-12);
    if (!(steps < static_cast<double>(kMaxSide))) {
      refuse(fmt::format("`spacing` of {:.6g} makes too many samples of {:.6g} x {:.6g}", *spacing, width, height));
    }
    return std::max<std::int64_t>(static_cast<std::int64_t>(areas ? std::ceil(steps - 0.5) : std::floor(steps) + 1.0),
                                  1);
  };
  const auto step = [&](double length, std::int64_t samples) {
    const std::int64_t steps = areas ? samples : samples - 1;
    return spacing ? *spacing : (steps > 0 ? length / static_cast<double>(steps) : length);
  };
  SampleGrid grid;
  grid.width = size ? size->first : count(width);
  grid.height = size ? size->second : count(height);
  require_size("a grid", grid.width, grid.height);
  grid.spacing_x = step(width, grid.width);
  grid.spacing_z = step(height, grid.height);
  grid.first_x = ground.x0 + (areas ? grid.spacing_x / 2.0 : 0.0);
  grid.first_z = ground.z0 + (areas ? grid.spacing_z / 2.0 : 0.0);
  return grid;
}

namespace {

/// Bounds in degrees, by as many turns on as bring them onto a grid's columns; all these where the bounds go round, or
/// lie on both ends of a grid that does.
MapBounds turned_onto(const SampleGrid& grid, double half, MapBounds bounds) {
  const double west = grid.first_x - half * grid.spacing_x;
  const double length = (static_cast<double>(grid.width - 1) + 2.0 * half) * grid.spacing_x;
  const double width = bounds.east - bounds.west;
  bounds.west -= kTurn * std::floor((bounds.west - west) / kTurn + 1e-9);
  bounds.east = bounds.west + width;
  // Where the ground begins behind the grid's East end it may end beyond its West one.
  if (bounds.west >= west + length) {
    bounds.west -= kTurn;
    bounds.east -= kTurn;
  }
  const bool goes_round = length >= kTurn - 1.5 * grid.spacing_x;
  if (width >= kTurn - grid.spacing_x || (goes_round && bounds.east > west + length + grid.spacing_x)) {
    return {west, bounds.south, west + length, bounds.north};
  }
  return bounds;
}

/// The rectangle of a projected source's own coordinates around some ground. Of all that the archive has: the source,
/// or of an extracted part the rectangle around its tiles.
MapBounds shown_of_source(const Metadata& metadata, const GridSystem& system, const WorldBounds& ground) {
  const Georeference& place = system.place;
  const SourceRecord& source = metadata.source;
  const double half = place.registration == Registration::kArea ? 0.5 : 0.0;
  const MapBounds all{place.origin_x - half * place.spacing_x,
                      place.origin_y - (static_cast<double>(source.height - 1) + half) * place.spacing_y,
                      place.origin_x + (static_cast<double>(all_columns(source) - 1) + half) * place.spacing_x,
                      place.origin_y + half * place.spacing_y};
  const WorldBounds& whole = metadata.valid;
  const bool is_whole =
      ground.x0 == whole.x0 && ground.z0 == whole.z0 && ground.x1 == whole.x1 && ground.z1 == whole.z1;
  if (is_whole && !is_cut(metadata)) return all;
  MapBounds shown = ImageFinder(metadata, system).image_of(ground).bounds;
  if (place.unit == HorizontalUnit::kDegree) {
    const SampleGrid columns{source.width, 1, place.origin_x, 0.0, place.spacing_x, place.spacing_y};
    shown = turned_onto(columns, half, shown);
  }
  return {std::max(shown.west, all.west), std::max(shown.south, all.south), std::min(shown.east, all.east),
          std::min(shown.north, all.north)};
}

/// Samples of `shown`, in the source's system.
SampleGrid grid_over_source(const Metadata& metadata, const std::shared_ptr<const GridSystem>& system,
                            const MapBounds& shown, const SourceGridRequest& request) {
  const Georeference& place = system->place;
  const SourceRecord& source = metadata.source;
  // In samples of the source, or in lengths in which a spacing is given.
  const double unit_x = !request.spacing ? 1.0 : request.in_world_units ? source.spacing_x : place.spacing_x;
  const double unit_z = !request.spacing ? 1.0 : request.in_world_units ? source.spacing_z : place.spacing_y;
  const WorldBounds ground{(shown.west - place.origin_x) / place.spacing_x * unit_x,
                           (place.origin_y - shown.north) / place.spacing_y * unit_z,
                           (shown.east - place.origin_x) / place.spacing_x * unit_x,
                           (place.origin_y - shown.south) / place.spacing_y * unit_z};
  SampleGrid grid{all_columns(source), source.height, 0.0, 0.0, unit_x, unit_z};
  if (request.size || request.spacing) {
    grid = grid_over(ground, place.registration == Registration::kArea, request.size, request.spacing);
  } else if (const auto part = part_of(grid, ground)) {
    grid = *part;
  } else {
    refuse("no sample of the archive's source lies there; give `size` or `spacing`");
  }
  grid.first_x = place.origin_x + grid.first_x / unit_x * place.spacing_x;
  grid.first_z = place.origin_y - grid.first_z / unit_z * place.spacing_y;
  grid.spacing_x = grid.spacing_x / unit_x * place.spacing_x;
  grid.spacing_z = grid.spacing_z / unit_z * place.spacing_y;
  grid.registration = place.registration;
  grid.in_degrees = place.unit == HorizontalUnit::kDegree;
  if (!grid.in_degrees) grid.system = system;
  return grid;
}

}  // namespace

SampleGrid grid_of_source(const Metadata& metadata, const SourceGridRequest& request) {
  require_spacing(request.spacing);
  if (request.size) require_size("a grid", request.size->first, request.size->second);
  const std::shared_ptr<const GridSystem> system = system_of_source(metadata);
  const Georeference& place = system->place;
  MapBounds shown = shown_of_source(metadata, *system, metadata.valid);
  if (request.box) {
    MapBounds box = *request.box;
    if (place.unit == HorizontalUnit::kDegree) {
      if (box.east <= box.west) box.east += kTurn;
      box = turned(box, shown.west, shown.east, metadata.source, kTurn, AcrossEnds::kGoesOn);
    }
    if (!(box.west < box.east)) refuse("West must be less than East");
    if (!(box.west <= shown.east && box.east >= shown.west && box.south <= shown.north && box.north >= shown.south))
      refuse("lies outside of what the archive covers");
    shown = box;
  }
  return grid_over_source(metadata, system, shown, request);
}

std::optional<Georeference> picture_georeference(const Metadata& metadata, const GridSize& size) {
  const SourceRecord& source = metadata.source;
  if (!source.origin_x || !source.origin_y || !(source.crs_spacing_x > 0.0) || !(source.crs_spacing_y > 0.0)) {
    return std::nullopt;
  }
  auto found = grid_georeference(metadata, grid_over(metadata.valid, true, size, {}));
  found->registration = Registration::kArea;
  if (is_warped(metadata)) return found;
  found->system.vertical_datum.clear();
  found->system.vertical_epsg.reset();
  return found;
}

bool is_source_system(const Metadata& metadata, const GridSystem& system) {
  const SourceRecord& source = metadata.source;
  const Georeference& place = system.place;
  return place.has_origin && source.origin_x == place.origin_x && source.origin_y == place.origin_y;
}

SampleGrid grid_in_system(const Metadata& metadata, const WorldBounds& ground, std::shared_ptr<const GridSystem> system,
                          const std::optional<GridSize>& size, const std::optional<double>& spacing) {
  if (!system || !system->map) refuse("there is no reference system for the grid; see understand_grid_system()");
  require_spacing(spacing);
  if (size) require_size("a grid", size->first, size->second);
  const Georeference& place = system->place;
  const std::optional<Georeference> own = grid_georeference(metadata, natural_grid(metadata));
  const bool is_own = place.has_origin && own && own->origin_x == place.origin_x && own->origin_y == place.origin_y;
  if (is_own && !spacing) {
    if (size) return grid_over(ground, samples_are_areas(metadata), size, spacing);
    if (const auto part = part_of(natural_grid(metadata), ground)) return *part;
    refuse("no sample of the archive's own grid lies there; give `size` or `spacing`");
  }
  if (is_warped(metadata) && is_source_system(metadata, *system)) {
    const auto own_system = system_of_source(metadata);
    return grid_over_source(metadata, own_system, shown_of_source(metadata, *own_system, ground),
                            {{}, size, spacing, false});
  }
  auto [bounds, stretch] = ImageFinder(metadata, *system).image_of(ground);
  SampleGrid grid;
  grid.registration = Registration::kArea;
  if (size) {
    grid.width = size->first;
    grid.height = size->second;
    grid.spacing_x = spacing.value_or((bounds.east - bounds.west) / static_cast<double>(grid.width));
    grid.spacing_z = spacing.value_or((bounds.north - bounds.south) / static_cast<double>(grid.height));
    grid.first_x = bounds.west + grid.spacing_x / 2.0;
    grid.first_z = bounds.north - grid.spacing_z / 2.0;
  } else {
    double step = spacing.value_or(0.0);
    if (!spacing) {
      const Georeference source = source_georeference(metadata.source);
      const bool in_degrees = source.unit == HorizontalUnit::kDegree && place.unit == HorizontalUnit::kDegree;
      if (in_degrees && std::abs(source.spacing_x - source.spacing_y) <= 1e-9 * source.spacing_x) {
        step = source.spacing_x;
      } else {
        // As many samples as the archive's own grid has there, to three digits.
        const SampleGrid natural = natural_grid(metadata);
        step = std::sqrt(stretch * natural.spacing_x * natural.spacing_z);
        const double grain = std::pow(10.0, std::floor(std::log10(step)) - 2.0);
        step = std::round(step / grain) * grain;
      }
    }
    require_fewer((bounds.east - bounds.west) / step, (bounds.north - bounds.south) / step);
    constexpr double kOnTheEdge = 1e-6;
    const double west = std::floor(bounds.west / step + kOnTheEdge);
    const double north = std::ceil(bounds.north / step - kOnTheEdge);
    grid.width = std::max<std::int64_t>(std::llround(std::ceil(bounds.east / step - kOnTheEdge) - west), 1);
    grid.height = std::max<std::int64_t>(std::llround(north - std::floor(bounds.south / step + kOnTheEdge)), 1);
    grid.spacing_x = grid.spacing_z = step;
    grid.first_x = (west + 0.5) * step;
    grid.first_z = (north - 0.5) * step;
  }
  grid.system = std::move(system);
  return grid;
}

bool samples_are_areas(const Metadata& metadata) {
  return is_warped(metadata) || metadata.source.registration == Registration::kArea;
}

bool is_in_source_system(const Metadata& metadata, const SampleGrid& grid) {
  return grid.in_degrees || (grid.system && is_source_system(metadata, *grid.system));
}

bool may_have_nodata(const Metadata& metadata, const SampleGrid& grid) {
  if (grid.goes_by_places()) {
    const SourceRecord& source = metadata.source;
    const bool is_sources = is_in_source_system(metadata, grid) && grid.width == all_columns(source) &&
                            grid.height == source.height && grid.first_x == source.origin_x &&
                            grid.first_z == source.origin_y && grid.spacing_x == source.crs_spacing_x;
    return !is_sources || is_cut(metadata) || metadata.statistics.voids > 0;
  }
  const WorldBounds& ground = metadata.valid;
  const auto turn = turn_of(metadata);
  const bool goes_round = turn && turn->ground_x1 - turn->ground_x0 >= turn->length * (1.0 - 1e-9);
  const double first_x = goes_round ? 0.0 : turn ? turn->onto_ground(grid.first_x, 0.0) : grid.first_x;
  const double last_x = goes_round ? 0.0 : first_x + static_cast<double>(grid.width - 1) * grid.spacing_x;
  const double last_z = grid.first_z + static_cast<double>(grid.height - 1) * grid.spacing_z;
  constexpr double kOnTheEdge = 1e-6;  // of a spacing; edges are computed by products
  return is_warped(metadata) || metadata.statistics.voids > 0 || first_x < 0.0 || grid.first_z < 0.0 ||
         last_x > ground.x1 + kOnTheEdge * grid.spacing_x || last_z > ground.z1 + kOnTheEdge * grid.spacing_z;
}

Georeference source_georeference(const SourceRecord& source) {
  Georeference own;
  own.registration = source.registration == Registration::kArea ? Registration::kArea : Registration::kPoint;
  own.unit = source.crs_unit == "metre"    ? HorizontalUnit::kMetre
             : source.crs_unit == "degree" ? HorizontalUnit::kDegree
                                           : HorizontalUnit::kUnknown;
  own.metres_per_unit = source.metres_per_unit;
  own.spacing_x = source.crs_spacing_x > 0.0 ? source.crs_spacing_x : source.spacing_x;
  own.spacing_y = source.crs_spacing_y > 0.0 ? source.crs_spacing_y : source.spacing_z;
  own.has_origin = source.origin_x.has_value() && source.origin_y.has_value();
  own.origin_x = source.origin_x.value_or(0.0);
  own.origin_y = source.origin_y.value_or(0.0);
  own.system.name = source.crs_name;
  own.system.epsg = source.crs_epsg;
  own.system.wkt = source.crs_wkt;
  own.system.body = source.body;
  own.system.semi_major_axis_m = source.semi_major_axis_m;
  own.system.inverse_flattening = source.inverse_flattening;
  own.system.vertical_datum = source.vertical_datum;
  own.system.vertical_epsg = source.vertical_epsg;
  return own;
}

std::optional<Georeference> grid_georeference(const Metadata& metadata, const SampleGrid& grid) {
  const SourceRecord& source = metadata.source;
  Georeference found = source_georeference(source);
  if (grid.goes_by_places()) {
    if (grid.system) {
      ReferenceSystem system = grid.system->place.system;
      system.vertical_datum = found.system.vertical_datum;
      system.vertical_epsg = found.system.vertical_epsg;
      found = grid.system->place;
      found.system = system;
    } else {
      found.unit = HorizontalUnit::kDegree;
      found.metres_per_unit = 1.0;
    }
    found.registration = grid.registration;
    found.has_origin = true;
    found.origin_x = grid.first_x;
    found.origin_y = grid.first_z;
    found.spacing_x = grid.spacing_x;
    found.spacing_y = grid.spacing_z;
    return found;
  }
  if (is_warped(metadata)) return map_georeference(metadata, grid);
  // World units to the source's own.
  const double per_x = source.crs_spacing_x > 0.0 ? source.crs_spacing_x / source.spacing_x : 1.0;
  const double per_z = source.crs_spacing_y > 0.0 ? source.crs_spacing_y / source.spacing_z : 1.0;
  if (grid.spacing_x != source.spacing_x || grid.spacing_z != source.spacing_z) {
    found.spacing_x = grid.spacing_x * per_x;
    found.spacing_y = grid.spacing_z * per_z;
  }
  if (found.has_origin) {
    found.origin_x += (grid.first_x - source.first_sample_x) * per_x;
    found.origin_y -= (grid.first_z - source.first_sample_z) * per_z;
  }
  // Without an origin a point of unit spacing is what a raster that says nothing is taken for.
  const bool has_spacing = found.spacing_x != 1.0 || found.spacing_y != 1.0;
  if (!found.has_origin && !has_spacing && found.registration != Registration::kArea) return std::nullopt;
  return found;
}

std::optional<SampleGrid> part_of(const SampleGrid& grid, const WorldBounds& ground) {
  constexpr double kOnTheEdge = 1e-6;  // of a spacing; edges are computed by products
  const auto first = [](double from, double start, double spacing) {
    return static_cast<std::int64_t>(std::ceil((from - start) / spacing - kOnTheEdge));
  };
  const auto last = [](double to, double start, double spacing) {
    return static_cast<std::int64_t>(std::floor((to - start) / spacing + kOnTheEdge));
  };
  const std::int64_t c0 = first(ground.x0, grid.first_x, grid.spacing_x);
  const std::int64_t r0 = first(ground.z0, grid.first_z, grid.spacing_z);
  SampleGrid part = grid;
  part.width = last(ground.x1, grid.first_x, grid.spacing_x) - c0 + 1;
  part.height = last(ground.z1, grid.first_z, grid.spacing_z) - r0 + 1;
  part.first_x = grid.first_x + static_cast<double>(c0) * grid.spacing_x;
  part.first_z = grid.first_z + static_cast<double>(r0) * grid.spacing_z;
  if (part.width < 1 || part.height < 1) return std::nullopt;
  return part;
}

WorldBounds world_bounds(const Metadata& metadata, const MapBounds& asked, AcrossEnds across) {
  const SourceRecord& source = metadata.source;
  if (!source.origin_x || !source.origin_y || !(source.crs_spacing_x > 0.0) || !(source.crs_spacing_y > 0.0)) {
    refuse("the archive does not say where its source lay; coordinates mean nothing");
  }
  const bool degrees = source_georeference(source).unit == HorizontalUnit::kDegree;
  MapBounds box = asked;
  if (degrees && box.east <= box.west) box.east += kTurn;
  if (!(box.west < box.east)) refuse("West must be less than East");
  if (is_warped(metadata)) {
    const ProjectionRecord& on = *metadata.projection;
    const Projection world(on.spec);
    const MapBounds map = degrees ? projected_bounds(world, GeoExtent{box.west, box.south, box.east, box.north})
                                  : projected_bounds(world, *source.map, box);
    if (!std::isfinite(map.west)) refuse("the archive's map has no place for a part of that");
    return {map.west - on.origin.easting, on.origin.northing - map.north, map.east - on.origin.easting,
            on.origin.northing - map.south};
  }
  const SourceColumns columns(source);
  if (const auto turn = once_round(metadata)) {
    const WorldBounds& ground = metadata.valid;
    box = turned(box, columns.coordinate(ground.x0), columns.coordinate(ground.x1), source, *turn, across);
  }
  const double to_z = source.spacing_z / source.crs_spacing_y;
  WorldBounds bounds;
  bounds.x0 = columns.world(box.west);
  bounds.x1 = columns.world(box.east);
  bounds.z0 = source.first_sample_z + (*source.origin_y - box.north) * to_z;
  bounds.z1 = source.first_sample_z + (*source.origin_y - box.south) * to_z;
  return bounds;
}

std::optional<SampleGrid> grid_like(const Metadata& metadata, const SourceInfo& other, std::vector<Warning>& warnings) {
  if (is_warped(metadata)) return grid_through_map(metadata, other);
  const SourceRecord& source = metadata.source;
  const Georeference& theirs = other.georeference;
  const HorizontalUnit unit = source_georeference(source).unit;
  const bool placed = source.origin_x && source.origin_y && theirs.has_origin && source.crs_spacing_x > 0.0 &&
                      source.crs_spacing_y > 0.0;
  if (placed) check_same_system(metadata, other);
  const bool same_unit = unit == theirs.unit || (placed && share_ground(source, other));
  if (placed && unit != theirs.unit) {
    warnings.push_back(fmt::format(
        "{}: does not say what its coordinates count (a .prj would); {}", other.path,
        same_unit ? "they are taken for those of the archive's reference system, on whose ground they lie"
                  : "on the archive's ground they do not lie, so its grid begins in the North-West corner there"));
  }
  if (!placed && source.origin_x) {
    warnings.push_back(fmt::format(
        "{}: does not say where it lies; its grid begins in the North-West corner of the archive", other.path));
  }
  if (!placed || !same_unit) return std::nullopt;
  const double to_x = source.spacing_x / source.crs_spacing_x;
  const double to_z = source.spacing_z / source.crs_spacing_y;
  return SampleGrid{other.width,
                    other.height,
                    source.first_sample_x + (theirs.origin_x - *source.origin_x) * to_x,
                    source.first_sample_z + (*source.origin_y - theirs.origin_y) * to_z,
                    theirs.spacing_x * to_x,
                    theirs.spacing_y * to_z};
}

}  // namespace isohf
