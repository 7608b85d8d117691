#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "isohf/projection/reference_map.h"
#include "isohf/surface.h"
#include "isohf/tile_range.h"

namespace isohf {

/// The samples of a grid in world units, continued on all sides, that lie in a part of the world; nullopt if none does.
[[nodiscard]] std::optional<SampleGrid> part_of(const SampleGrid& grid, const WorldBounds& ground);

/// Once round the body, where columns of an archive's world are longitudes.
struct Turn {
  double length;  ///< world units
  double ground_x0;
  double ground_x1;

  /// As many turns on as bring x onto the ground; x itself where none do.
  [[nodiscard]] double onto_ground(double x, double tolerance) const;
};
[[nodiscard]] std::optional<Turn> turn_of(const Metadata& metadata);

/// "metres".
[[nodiscard]] std::string describe_unit(HorizontalUnit unit);
/// "EPSG:32632", a name in quotes, or by the ellipsoid.
[[nodiscard]] std::string describe_system(const ReferenceSystem& system);
/// Throws Error{kInvalidArgument}: another raster is in another system than the archive's source.
[[noreturn]] void refuse_system(const SourceInfo& other, const ReferenceSystem& own);

/// What becomes of a box that lies at both ends of an archive that goes round the body.
enum class AcrossEnds : std::uint8_t {
  kRefused,  ///< it is no rectangle of the world
  kGoesOn,   ///< beyond the East end; RowReader finds each column by whole turns
};

/// The part of the world in a box of the source's coordinates. Longitudes are compared modulo 360 degrees; West above
/// East crosses the 180th meridian.
/// Throws Error{kInvalidArgument} where the archive does not know where its source lay, where West is not less than
/// East in a source that is not in degrees, and where the ground lies at both ends of the archive, unless it goes round
/// and `across` lets the box go on.
[[nodiscard]] WorldBounds world_bounds(const Metadata& metadata, const MapBounds& box, AcrossEnds across);

/// What is asked for in the reference system of an archive's source; without anything the source's own samples.
struct SourceGridRequest {
  std::optional<MapBounds> box;  ///< its coordinates; as world_bounds() takes it
  std::optional<GridSize> size;
  std::optional<double> spacing;
  bool in_world_units =
      true;  ///< `spacing`, which counts as in the middle of the source; false: the system's own units
};
/// The grid of a projected archive in the reference system of its source, as if it had not been projected: samples that
/// stand for areas or are posts as the source's do; of an extracted part those on the rectangle around it.
/// Throws Error{kInvalidArgument} where the box holds nothing, or the source's map is not understood.
[[nodiscard]] SampleGrid grid_of_source(const Metadata& metadata, const SourceGridRequest& request);
/// Where a picture lies that shows what the source covered in `size` areas; nullopt if the source did not say where it
/// lies.
[[nodiscard]] std::optional<Georeference> picture_georeference(const Metadata& metadata, const GridSize& size);
/// True where coordinates are those of the source.
[[nodiscard]] bool is_source_system(const Metadata& metadata, const GridSystem& system);
[[nodiscard]] bool is_in_source_system(const Metadata& metadata, const SampleGrid& grid);

/// The grid of another raster of elevations, in the archive's world or, where the archive's input was projected, in
/// the system of that. By the origins of both, also where one has no unit that is known and their grounds meet; never
/// through a projection, where it has to be in the source's system or on the archive's own map. Its longitudes stay as
/// it counts them: RowReader finds each column by whole turns. nullopt where nothing ties the two, and it is to begin
/// in the North-West corner. A warning says what was taken for granted.
/// Throws Error{kInvalidArgument} where the two are known to be in different units, reference systems or bodies.
[[nodiscard]] std::optional<SampleGrid> grid_like(const Metadata& metadata, const SourceInfo& other,
                                                  std::vector<Warning>& warnings);

}  // namespace isohf
