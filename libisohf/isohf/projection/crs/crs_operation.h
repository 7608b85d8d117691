#pragma once

#include <memory>
#include <string>

#include "isohf/projection.h"
#include "isohf/raster.h"

namespace isohf {

/// A system, and the body that it was moved to.
struct SystemOnBody {
  std::string text;
  std::string body = {};  ///< "Mars"; empty: it was not moved
};

/// `text`, or its projection on the body that a raster is of, whose `ellipsoid` is given: codes and PROJ strings that
/// state no body are of the Earth only for want of another. Throws Error{kInvalidArgument} if `text` states another
/// body, or is not a map; else as Crs::parse.
[[nodiscard]] SystemOnBody on_body_of(const ReferenceSystem& raster, const Ellipsoid& ellipsoid,
                                      const std::string& text);

/// The operation from the longitudes and latitudes of one reference system to the coordinates of another.
struct WayToSystem {
  MappedSystem system;
  bool is_projected = true;                 ///< else coordinates are longitudes and latitudes of the other system
  std::shared_ptr<const ReferenceMap> map;  ///< in units of the system
  bool is_ballpark = false;                 ///< PROJ knows no relation of the datums: they are taken for one
};

/// What to warn of where a way is_ballpark. `from`: "its datum", "the datum of A".
[[nodiscard]] std::string ballpark_note(const std::string& from, const WayToSystem& way);

/// Of PROJ's operations over a ground the first that transforms most of it; ballpark ones only as a last resort, those
/// with missing grids never. `from` is a system whose datum alone matters; where it says nothing, WGS 84. Throws
/// Error{kUnsupported}, in one line, where there is no operation; else as Crs::parse.
[[nodiscard]] WayToSystem find_way(const ReferenceSystem& from, const std::string& to, const GeoExtent& ground,
                                   const Ellipsoid& ellipsoid);

/// The map of an archive that lies on a reference system, metres, `ellipsoid` being that of its longitudes and
/// latitudes. Throws Error{kUnsupported} where PROJ cannot do its operation: a grid is missing.
[[nodiscard]] std::shared_ptr<const ReferenceMap> understand_way(const MappedSystem& system,
                                                                 const Ellipsoid& ellipsoid);

}  // namespace isohf
