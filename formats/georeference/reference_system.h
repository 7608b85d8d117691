#pragma once

#include <memory>
#include <optional>
#include <string>

#include "formats/georeference/proj_module.h"
#include "isohf/projection/reference_map.h"
#include "isohf/raster.h"

namespace isohf {

/// A reference system as PROJ understands it.
class UnderstoodSystem : public ReferenceMap {
 public:
  struct Description {
    std::string name;  ///< of the horizontal part
    std::string authority;
    std::string code;  ///< "EPSG" and "32632"; empty where the text gives none
    std::string datum;
    bool is_datum_known = true;  ///< false: nothing but an ellipsoid is named
    bool is_projected = false;
    bool is_compound = false;         ///< heights belong to it
    double unit = 1.0;                ///< of the system's axes: metres, or degrees where it is not projected
    double prime_meridian_deg = 0.0;  ///< East of Greenwich
    std::string wkt2;                 ///< of all of it (ISO 19162:2019)
    std::string wkt1;                 ///< as GDAL writes it; empty where that cannot say it
    std::string esri;                 ///< as a .prj has it; the same
    Ellipsoid ellipsoid;
    std::string vertical_name;  ///< "NAVD88 height (ftUS)"; empty where nothing is said of heights
    std::optional<int> vertical_epsg;
    std::string vertical_unit;              ///< "US survey foot"
    double metres_per_vertical_unit = 1.0;  ///< negative: depths
  };
  [[nodiscard]] virtual const Description& description() const = 0;
  /// Whether both are one system, however they are spelled and named.
  [[nodiscard]] virtual bool is_same(const UnderstoodSystem& other) const = 0;
  /// The same, but a datum that one of them leaves unknown may be the other's.
  [[nodiscard]] virtual bool may_be(const UnderstoodSystem& other) const = 0;
};

/// Understands "EPSG:2154", WKT of any version and dialect, PROJ strings and PROJJSON, by the module isohf_proj.so,
/// which is loaded at the first call. Coordinates are the system's own, East before North. metres_per_unit  of the
/// coordinates that are asked for; nullopt: as the system has it. vertical_epsg  of the heights, where the text has
/// none. Throws Error{kUnsupported}, in one line, where the module or PROJ's database is missing, or PROJ does not
/// understand the text.
[[nodiscard]] std::shared_ptr<const UnderstoodSystem> understand_system(
    const std::string& text, std::optional<double> metres_per_unit = std::nullopt,
    std::optional<int> vertical_epsg = std::nullopt);

/// The same where coordinates and places are all that is wanted: PROJ is left alone where utm_map() knows the system.
[[nodiscard]] std::shared_ptr<const ReferenceMap> understand_map(const std::string& text,
                                                                 std::optional<double> metres_per_unit);

/// A system, and the body that it was moved to.
struct SystemOnBody {
  std::string text;
  std::string body = {};  ///< "Mars"; empty: it was not moved
};

/// `text`, or its projection on the body that a raster is of, whose `ellipsoid` is given: codes and PROJ strings that
/// state no body are of the Earth only for want of another. Throws Error{kInvalidArgument} if `text` states another
/// body, or is not a map; else as understand_system.
[[nodiscard]] SystemOnBody on_body_of(const ReferenceSystem& raster, const Ellipsoid& ellipsoid,
                                      const std::string& text);

/// A way from the longitudes and latitudes of one reference system to the coordinates of another.
struct WayToSystem {
  MappedSystem system;
  bool is_projected = true;                 ///< else coordinates are longitudes and latitudes of the other system
  std::shared_ptr<const ReferenceMap> map;  ///< in units of the system
  bool is_ballpark = false;                 ///< PROJ knows no relation of the datums: they are taken for one
};

/// PROJ's best way over a ground, without grids that are missing. `from` is a system whose datum alone matters; where it
/// says nothing, WGS 84. Throws Error{kUnsupported}, in one line, as understand_system, and where there is no way.
[[nodiscard]] WayToSystem find_way(const ReferenceSystem& from, const std::string& to, const GeoExtent& ground,
                                   const Ellipsoid& ellipsoid);

/// The map of an archive that lies on a reference system, metres, `ellipsoid` being that of its longitudes and
/// latitudes. Throws Error{kUnsupported} where the module or a grid is missing.
[[nodiscard]] std::shared_ptr<const ReferenceMap> understand_way(const MappedSystem& system,
                                                                 const Ellipsoid& ellipsoid);

/// What names the system to PROJ: "EPSG:n", or the WKT; empty where a file has neither.
[[nodiscard]] std::string system_text(const ReferenceSystem& system);

/// For messages: what coordinates are in, "degrees"; and of which system, "EPSG:n", else its name, else that.
[[nodiscard]] std::string unit_name(const Georeference& place);
[[nodiscard]] std::string name_of(const Georeference& place);

/// Takes `text`, which understand_system() understands, for what the coordinates of a raster are in, whatever its file
/// says, and for its heights where it speaks of them. Throws what that throws; Error{kUnsupported} for angles that are
/// no degrees from Greenwich, and for depths.
void take_system(const std::string& text, SourceInfo& info);

/// Completes what a raster's file says of its reference system by what the user says: a system where it has none, a
/// datum that it leaves unknown, a code, heights. Throws what take_system() throws, and Error{kInvalidArgument} where
/// the two contradict each other.
void complete_system(const std::string& text, SourceInfo& info);

/// Unit and name of the heights of a vertical system by its code; nothing where there is no module.
void take_heights(int vertical_epsg, SourceInfo& info);

/// What heights are above that a system of longitudes, latitudes and heights gives.
inline constexpr const char* kAboveEllipsoid = ISOHF_ELLIPSOIDAL_HEIGHT;

/// Whether a code of EPSG's is that of such a system (EPSG:4979). PROJ is left alone for the usual systems of two
/// dimensions; false where there is no module.
[[nodiscard]] bool gives_heights_above_ellipsoid(int epsg);

/// Text that other programs read: WKT1 as a GeoTIFF's citation and an .aux.xml carry it, or the ESRI dialect of a .prj;
/// heights included. Without the module, or where a dialect has no words for it: the WKT as it was found; without one
/// empty.
enum class WktDialect { kGdal, kEsri };
[[nodiscard]] std::string wkt_of(const ReferenceSystem& system, WktDialect dialect);

/// Whether two systems are one, as far as it can be told: by their codes, their texts, else by PROJ. nullopt where one
/// of them says nothing, or neither can be understood.
[[nodiscard]] std::optional<bool> are_same(const ReferenceSystem& a, const ReferenceSystem& b);

}  // namespace isohf
